"""Packages and links that another user of the host puts into the shared folder for temporary files."""

import os
import stat
import subprocess
import sys

import pytest

from places import ROOT

NOBODY = 65534
# $1: a file to which links point.
PLANT = """set -e
umask 0
for package in diff_encoder_sim distributed numpy xacro; do
  mkdir -p $package
  echo "open(__file__ + '.executed', 'w').close()" >$package/__init__.py
done
mkdir kernels
ln -s "$1" global.lock
echo "cache_dir: $PWD/kernels" >.numba_config.yaml
"""
# Each one reads the results of those before it.
COMMANDS = [
    'campaign --config quick --tests SMT --ppr 90 --trials 1 --workers 1 --out {made}/campaign',
    'analyze {made}/campaign',
    'advise --robot burger --no-trials --tests SL --ppr 40 90 --out {made}/advice',
    'reencode {made}/campaign/bags/SMT_90_001.bag --ppr 40',
    'check_robot {root}/urdf/alto.urdf.xacro',
]

AS_ROOT = pytest.mark.skipif(os.geteuid() != 0, reason=f'only root can play the user {NOBODY}')
pytestmark = [pytest.mark.timeout(300), AS_ROOT]


def _become_nobody():
    os.setgroups([])
    os.setgid(NOBODY)
    os.setuid(NOBODY)


def content(folder):
    """Mode, owner and bytes of all files, by path."""
    found = {path: path.lstat() for path in sorted(folder.rglob('*'))}
    return {
        path: (status.st_mode, status.st_uid, path.read_bytes() if stat.S_ISREG(status.st_mode) else b'')
        for path, status in found.items()
    }


@pytest.mark.long
def test_commands_in_a_shared_folder_run_nothing_of_another_user(tmp_path, monkeypatch):
    shared, precious = tmp_path / 'shared', tmp_path / 'precious'
    shared.mkdir()
    shared.chmod(0o1777)
    precious.write_text('mine')
    plant = ['/bin/sh', '-c', PLANT, 'plant', str(precious)]
    subprocess.run(plant, cwd=str(shared), preexec_fn=_become_nobody, check=True)
    planted = content(shared)
    monkeypatch.setenv('TMPDIR', str(shared))
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
    environment.pop('NUMBA_CACHE_DIR', None)
    for command in COMMANDS:
        name, *arguments = command.format(made=tmp_path, root=ROOT).split()
        words = [sys.executable, ROOT / 'scripts' / name, *arguments]
        done = subprocess.run(words, cwd=shared, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert content(shared) == planted
        assert precious.read_text() == 'mine'
