"""Campaigns and Dask clusters as processes of a test, with trials that take no time (campaign_trials.py)."""

import contextlib
import csv
import json
import os
import subprocess
import sys
import time

import campaign_trials
import psutil
from distributed import Client

from places import ROOT

HERE = ROOT / 'test'
TRIALS = 24
ARGUMENTS = ['--config', 'paper', '--tests', 'SL', '--ppr', '40', '90', '--trials', '12']
PATIENCE_S = 100.0


class Machine:
    """Processes of one test, and the folder whose files make its trials go wrong; a context that ends the processes."""

    def __init__(self, folder):
        self.folder, self.out, self.processes = folder, folder / 'out', []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.communicate()

    def start(self, *command, trial_s=0.0):
        environment = {
            **os.environ,
            'PYTHONPATH': os.pathsep.join([str(HERE), *filter(None, sys.path)]),
            campaign_trials.FOLDER: str(self.folder),
            campaign_trials.TRIAL_S: str(trial_s),
        }
        pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'start_new_session': True}
        process = subprocess.Popen([sys.executable, *map(str, command)], env=environment, cwd=self.folder, **pipes)
        self.processes.append(process)
        return process

    def campaign(self, *arguments, trial_s=0.0):
        return self.start(HERE / 'campaign_trials.py', *ARGUMENTS, '--out', self.out, *arguments, trial_s=trial_s)

    def cluster(self, workers=2, trial_s=0.0, preload=(), tls=()):
        """A scheduler and workers without nannies, with options for TLS; returns the address and the processes."""
        about = self.folder / 'scheduler.json'
        private = '--no-dashboard', *tls
        local = '--host', '127.0.0.1', '--port', '0', '--scheduler-file', about
        scheduler = self.start('-m', 'distributed.cli.dask_scheduler', *local, *private)
        wait_until(lambda: about.exists() and about.read_text().endswith('}'))
        address = json.loads(about.read_text())['address']
        one = '--no-nanny', '--nthreads', '1', '--memory-limit', '0', '--local-directory', self.folder / 'scratch'
        command = '-m', 'distributed.cli.dask_worker', address, *one, *preload, *private
        started = [self.start(*command, trial_s=trial_s) for _ in range(workers)]
        if not tls:
            with Client(address, set_as_default=False) as client:
                client.wait_for_workers(workers, timeout=PATIENCE_S)
        return address, scheduler, started

    def attempts(self):
        """(process id, trial) of each trial that was begun."""
        log = self.folder / campaign_trials.LOG
        return [tuple(map(int, line.split())) for line in log.read_text().splitlines()] if log.exists() else []

    def wait_for_attempts(self, count):
        wait_until(lambda: len(self.attempts()) >= count)


def wait_until(condition):
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, 'waited in vain'
        time.sleep(0.05)


def workers_of(client):
    """The worker processes of a campaign that runs on this host."""
    with contextlib.suppress(psutil.NoSuchProcess):
        return [child for child in psutil.Process(client.pid).children() if 'spawn_main' in ' '.join(child.cmdline())]
    return []


def finish(process):
    """Exit status, lines of stdout, lines of stderr that are the program's own, but for how the robot stops."""
    out, err = process.communicate(timeout=PATIENCE_S)
    others = ('pybullet build time', 'campaign: stopping: ')
    lines = [line for line in err.decode().splitlines() if not line.startswith(others)]
    return process.returncode, out.decode().splitlines(), lines


def results(folder):
    """What a campaign leaves: its table but for wall times, and its bags. Nothing else may be there."""
    with open(str(folder / 'trials.csv'), newline='') as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        assert float(row.pop('wall_time_s')) >= 0.0
    assert {path.name for path in folder.iterdir()} == {'.lock', 'manifest.json', 'trials.csv', 'bags'}
    return rows, {path.name: path.read_bytes() for path in (folder / 'bags').iterdir()}


def campaign_lines(lines):
    return [line for line in lines if line.startswith('campaign: ')]
