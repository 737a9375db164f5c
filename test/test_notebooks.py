"""The notebooks of docs/ run as they stand, and print and draw what they show.

DOCUMENTED_OUTPUT=write writes what they print and draw into them.
"""

import json
import os
import shutil

import pytest

from documented_commands import difference
from notebooks import code_cells, run, show, shown
from places import ROOT, SOURCE

NOTEBOOKS = sorted((ROOT / 'docs' / 'notebooks').glob('*.ipynb'))


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 2


@pytest.mark.timeout(280)
@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_prints_and_draws_what_it_shows(path, tmp_path):
    notebook = json.loads(path.read_text())
    shutil.copy(str(ROOT / 'docs' / 'notebooks' / 'drive.bag'), str(tmp_path))
    done = run(notebook, tmp_path, {**os.environ, 'PYTHONPATH': str(SOURCE)})
    if os.environ.get('DOCUMENTED_OUTPUT') == 'write':
        show(notebook, done)
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + '\n')
        return
    for cell, (printed, drawn) in zip(code_cells(notebook), done):
        text, pictures = shown(cell)
        assert difference(text, printed) == ''
        assert len(drawn) == len(pictures)
