"""The notebooks of docs/ run as they stand, and print and draw the shown output.

DOCUMENTED_OUTPUT=write writes their output into them.
"""

import json
import os
import shutil
import subprocess
import sys

import pytest

from documented_commands import difference
from places import ROOT, SOURCE

NOTEBOOKS = sorted((ROOT / 'docs' / 'notebooks').glob('*.ipynb'))
WRITES = os.environ.get('DOCUMENTED_OUTPUT') == 'write'

# Runs cells in one namespace, as Jupyter does; prints the output of each and its chart, as PNG in base64 or validated.
RUN = """
import ast, base64, contextlib, io, json, sys

def run(source, namespace):
    *body, last = ast.parse(source).body
    exec(compile(ast.Module(body, []), 'cell', 'exec'), namespace)
    if isinstance(last, ast.Expr):
        return eval(compile(ast.Expression(last.value), 'cell', 'eval'), namespace)
    exec(compile(ast.Module([last], []), 'cell', 'exec'), namespace)

def png(content):
    import altair, vl_convert
    version = '.'.join(altair.SCHEMA_VERSION.lstrip('v').split('.')[:2])
    return base64.b64encode(vl_convert.vegalite_to_png(content, vl_version=version)).decode()

namespace, done = {'__name__': '__main__'}, []
for source in json.load(sys.stdin):
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        chart = run(source, namespace)
    drawn = [chart.to_dict()] if hasattr(chart, 'to_dict') else []
    done.append([printed.getvalue(), [png(each) if len(sys.argv) > 1 else '' for each in drawn]])
print(json.dumps(done))
"""


@pytest.mark.timeout(280)
@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_prints_and_draws_its_output(path, tmp_path):
    notebook = json.loads(path.read_text())
    shutil.copy(str(ROOT / 'docs' / 'notebooks' / 'drive.bag'), str(tmp_path))
    cells = [cell for cell in notebook['cells'] if cell['cell_type'] == 'code']
    done = subprocess.run(
        [sys.executable, '-c', RUN, *(['png'] if WRITES else [])],
        input=json.dumps([''.join(cell['source']) for cell in cells]),
        env={**os.environ, 'PYTHONPATH': str(SOURCE)},
        cwd=str(tmp_path),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    for cell, (printed, drawn) in zip(cells, json.loads(done.stdout.splitlines()[-1])):
        shown = [each for each in cell['outputs'] if each['output_type'] == 'display_data']
        if WRITES:
            stream = {'name': 'stdout', 'output_type': 'stream', 'text': printed.splitlines(keepends=True)}
            pictures = [{'image/png': picture, 'text/plain': ['alt.Chart(...)']} for picture in drawn]
            displayed = [{'data': each, 'metadata': {}, 'output_type': 'display_data'} for each in pictures]
            cell['outputs'] = [*([stream] if printed else []), *displayed]
        else:
            text = ''.join(''.join(each['text']) for each in cell['outputs'] if each['output_type'] == 'stream')
            assert difference(text, printed) == '' and len(drawn) == len(shown)
    if WRITES:
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + '\n')
