"""Commands by `python -OO`, which removes docstrings and asserts, in their worker processes, too."""

import os
import subprocess
import sys

import pytest

from places import ROOT

# Each one reads the results of those before it.
COMMANDS = [
    'campaign --config quick --tests SMT --ppr 90 --trials 1 --workers 1 --out {made}/campaign',
    'analyze {made}/campaign',
    'advise --robot burger --no-trials --tests SMT --ppr 40 90 --out {made}/advice',
]


@pytest.mark.timeout(300)
def test_commands_need_no_docstrings(tmp_path):
    paths = os.pathsep.join(filter(None, sys.path))
    for command in COMMANDS:
        name, *arguments = command.format(made=tmp_path).split()
        done = subprocess.run(
            [sys.executable, str(ROOT / 'scripts' / name), *arguments],
            cwd=str(tmp_path),
            env={**os.environ, 'PYTHONPATH': paths, 'PYTHONOPTIMIZE': '2'},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
