"""Folders, packages and links that another user of the host puts into the shared folder for temporary files."""

import contextlib
import json
import os
import re
import stat
import subprocess
import sys
import threading

import campaign_trials
import pytest

from campaign_processes import Machine, finish, results, wait_until, workers_of
from places import ROOT

NOBODY = 65534
# tempfile looks for a folder that it can write: a new file of mode 0600, which it removes at once.
TRIED_BY_TEMPFILE = re.compile(r'[a-z0-9_]{8}')
# $1: a file that links name; $2: the number of the user who is attacked.
PLANT = """set -e
umask 0
for folder in . dask-scratch-space dask-scratch-space-$2; do
  for package in diff_encoder_sim distributed numpy xacro; do
    mkdir -p $folder/$package
    echo "open(__file__ + '.executed', 'w').close()" >$folder/$package/__init__.py
  done
  ln -s "$1" $folder/global.lock
  ln -s "$1" $folder/purge.lock
done
mkdir kernels
ln -s kernels diff_encoder_sim-$2
echo "cache_dir: $PWD/kernels" >.numba_config.yaml
"""

pytestmark = [
    pytest.mark.timeout(300),
    pytest.mark.skipif(os.geteuid() != 0, reason=f'only root can play the user {NOBODY}'),
]


class SharedFolder:
    """A folder like /tmp after an attack, and a file of the attacked user."""

    def __init__(self, folder):
        self.precious = folder / 'precious'
        self.precious.write_text('mine')
        self.path = folder / 'shared'
        self.path.mkdir()
        self.path.chmod(0o1777)
        command = ['/bin/sh', '-c', PLANT, 'plant', str(self.precious), str(os.geteuid())]
        subprocess.run(command, cwd=str(self.path), preexec_fn=_become_nobody, check=True)
        self.planted = self.content()
        self.seen = {}  # mode of all that appeared later, by name

    def content(self):
        """Mode, owner and bytes of all files, by path."""
        paths = sorted(self.path.rglob('*'))
        return {str(path.relative_to(self.path)): _about(path) for path in paths}

    @contextlib.contextmanager
    def watched(self):
        """Look for new entries while something runs."""
        ended = threading.Event()
        thread = threading.Thread(target=self._watch, args=(ended,))
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def _watch(self, ended):
        while not ended.wait(0.002):
            for entry in os.scandir(str(self.path)):
                if entry.name not in self.planted:
                    with contextlib.suppress(FileNotFoundError):
                        self.seen[entry.name] = entry.stat(follow_symlinks=False).st_mode

    def check_untouched(self):
        assert self.content() == self.planted
        assert self.precious.read_text() == 'mine'
        open_to_others = {
            name: oct(mode)
            for name, mode in self.seen.items()
            if mode != stat.S_IFDIR | 0o700 and not TRIED_BY_TEMPFILE.fullmatch(name)
        }
        assert open_to_others == {}


def _become_nobody():
    os.setgroups([])
    os.setgid(NOBODY)
    os.setuid(NOBODY)


def _about(path):
    status = path.lstat()
    return status.st_mode, status.st_uid, path.read_bytes() if stat.S_ISREG(status.st_mode) else b''


@pytest.fixture
def shared(tmp_path, monkeypatch):
    shared = SharedFolder(tmp_path)
    monkeypatch.setenv('TMPDIR', str(shared.path))
    return shared


@pytest.fixture
def machine(tmp_path):
    machine = Machine(tmp_path)
    yield machine
    machine.close()


def searched(machine):
    """The entries of sys.path of the workers."""
    lines = (machine.folder / campaign_trials.SEARCHED).read_text().splitlines()
    return {entry for line in lines for entry in json.loads(line)}


def test_a_campaign_runs_nothing_of_another_user(machine, shared):
    with shared.watched():
        code, _, err = finish(machine.campaign('--workers', '2'))
    assert code == 0, err
    assert len(results(machine.out)[0]) == 24
    shared.check_untouched()
    assert [entry for entry in searched(machine) if entry.startswith(str(shared.path))] == []


def test_a_killed_campaign_leaves_no_worker_and_only_private_folders(machine, shared):
    process = machine.campaign('--workers', '2', trial_s=0.3)
    machine.wait_for_attempts(3)
    workers = workers_of(process)
    assert len(workers) == 2
    process.kill()
    wait_until(lambda: not any(worker.is_running() for worker in workers))
    left = {path.name: path.lstat().st_mode for path in shared.path.iterdir() if path.name not in shared.planted}
    assert set(left.values()) <= {stat.S_IFDIR | 0o700}, left


# Each one reads the results of those before it.
COMMANDS = [
    'campaign --config quick --tests SMT --ppr 90 --trials 1 --workers 1 --out {made}/campaign',
    'analyze {made}/campaign',
    'advise --robot burger --no-trials --tests SL --ppr 40 90 --out {made}/advice',
    'reencode {made}/campaign/bags/SMT_90_001.bag --ppr 40',
    'check_robot {root}/urdf/alto.urdf.xacro',
]


def test_commands_in_a_shared_folder_run_nothing_of_another_user(tmp_path, shared):
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
    environment.pop('NUMBA_CACHE_DIR', None)
    for command in COMMANDS:
        name, *arguments = command.format(made=tmp_path, root=ROOT).split()
        with shared.watched():
            done = subprocess.run(
                [sys.executable, str(ROOT / 'scripts' / name), *arguments],
                cwd=str(shared.path),
                env=environment,
                capture_output=True,
                text=True,
            )
        assert done.returncode == 0, done.stderr
        shared.check_untouched()
