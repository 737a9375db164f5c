"""The campaign command on real Dask processes: every trial ends up once, whatever dies.

Trials take no time (campaign_trials.py); what a trial computes has tests of its own.
"""

import csv
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import campaign_trials
import psutil
import pytest
from distributed import Client

HERE = Path(__file__).resolve().parent
TRIALS = 24
ARGUMENTS = ['--config', 'paper', '--tests', 'SL', '--ppr', '40', '90', '--trials', '12']
PATIENCE_S = 40.0

pytestmark = pytest.mark.timeout(120)


class Machine:
    """Processes of one test, and the folder whose files make its trials go wrong."""

    def __init__(self, folder):
        self.folder = folder
        self.out = folder / 'out'
        self.log = folder / campaign_trials.LOG
        self._processes = []

    def start(self, *command, trial_s=0.0, **options):
        environment = {
            **os.environ,
            'PYTHONPATH': os.pathsep.join([str(HERE), *filter(None, sys.path)]),
            campaign_trials.FOLDER: str(self.folder),
            campaign_trials.TRIAL_S: str(trial_s),
        }
        process = subprocess.Popen(
            [sys.executable, *map(str, command)],
            env=environment,
            cwd=str(self.folder),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            **options,
        )
        self._processes.append(process)
        return process

    def campaign(self, *arguments, trial_s=0.0):
        return self.start(HERE / 'campaign_trials.py', *ARGUMENTS, '--out', self.out, *arguments, trial_s=trial_s)

    def cluster(self, workers=2, trial_s=0.0, preload=()):
        """A scheduler and workers without nannies; returns the address and the processes."""
        about = self.folder / 'scheduler.json'
        scheduler = self.start(
            '-m',
            'distributed.cli.dask_scheduler',
            '--host',
            '127.0.0.1',
            '--port',
            '0',
            '--no-dashboard',
            '--scheduler-file',
            about,
        )
        wait_until(lambda: about.exists() and about.read_text().endswith('}'))
        address = json.loads(about.read_text())['address']
        started = [
            self.start(
                '-m',
                'distributed.cli.dask_worker',
                address,
                '--no-nanny',
                '--nthreads',
                '1',
                '--no-dashboard',
                '--memory-limit',
                '0',
                '--local-directory',
                self.folder / 'scratch',
                *preload,
                trial_s=trial_s,
            )
            for _ in range(workers)
        ]
        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=PATIENCE_S)
        return address, scheduler, started

    def attempts(self):
        """(process id, trial) of each trial that was begun."""
        lines = self.log.read_text().splitlines() if self.log.exists() else []
        return [tuple(map(int, line.split())) for line in lines]

    def wait_for_attempts(self, count):
        wait_until(lambda: len(self.attempts()) >= count)

    def close(self):
        for process in self._processes:
            if process.poll() is None:
                process.kill()
            process.communicate()


@pytest.fixture
def machine(tmp_path):
    machine = Machine(tmp_path)
    yield machine
    machine.close()


@pytest.fixture(scope='module')
def undisturbed(tmp_path_factory):
    machine = Machine(tmp_path_factory.mktemp('undisturbed'))
    assert finish(machine.campaign('--workers', '2'))[0] == 0
    machine.close()
    return results(machine.out)


def wait_until(condition):
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, 'waited in vain'
        time.sleep(0.05)


def finish(process):
    """Exit status, lines of stdout, lines of stderr that are the program's own."""
    out, err = process.communicate(timeout=PATIENCE_S)
    lines = [line for line in err.decode().splitlines() if not line.startswith('pybullet build time')]
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


def test_each_trial_has_a_row_and_a_bag(undisturbed):
    rows, bags = undisturbed
    assert [(row['ppr'], int(row['trial'])) for row in rows] == [
        (ppr, trial) for ppr in ('40', '90') for trial in range(1, 13)
    ]
    assert Counter(row['outcome'] for row in rows) == {'succeeded': 20, 'timed_out': 4}
    assert sorted('bags/' + name for name in bags) == sorted(row['bag'] for row in rows)


@pytest.mark.parametrize('workers', [1, 3])
def test_the_number_of_workers_changes_nothing(machine, undisturbed, workers):
    code, out, err = finish(machine.campaign('--workers', workers))
    assert code == 0, err
    assert out[0] == str(machine.out / 'trials.csv')
    assert '24 of 24 trials, 4 failed' in err[-1]
    assert results(machine.out) == undisturbed


def test_a_worker_killed_in_mid_campaign_costs_no_trial(machine, undisturbed):
    address, _, workers = machine.cluster(trial_s=0.1)
    client = machine.campaign('--scheduler', address)
    wait_until(lambda: len(machine.attempts()) >= 6 and workers[0].pid in dict(machine.attempts()))
    workers[0].kill()
    code, _, err = finish(client)
    assert (code, campaign_lines(err)) == (0, [])
    assert len(machine.attempts()) > TRIALS  # what it was at was begun again
    assert results(machine.out) == undisturbed


def test_local_workers_that_are_killed_are_replaced(machine, undisturbed):
    client = machine.campaign('--workers', '2', trial_s=0.1)
    wait_until(lambda: len(dict(machine.attempts())) == 2)
    for process_id in dict(machine.attempts()):
        os.kill(process_id, signal.SIGKILL)
    code, _, err = finish(client)
    assert (code, campaign_lines(err)) == (0, [])
    assert len({process for process, _ in machine.attempts()}) == 4
    assert results(machine.out) == undisturbed


def test_bags_come_over_the_network_where_the_folder_is_not_shared(machine, undisturbed):
    address, _, _ = machine.cluster(preload=('--preload', HERE / 'campaign_blind_worker.py'))
    assert finish(machine.campaign('--scheduler', address))[0] == 0
    assert results(machine.out) == undisturbed
    assert not list((machine.folder / 'scratch').rglob('*.bag*'))


@pytest.mark.parametrize(('name', 'code'), [('SIGINT', 130), ('SIGTERM', 143), ('SIGKILL', -signal.SIGKILL)])
def test_a_stopped_client_leaves_no_process_and_can_be_resumed(machine, undisturbed, name, code):
    client = machine.campaign('--workers', '2', trial_s=0.2)
    machine.wait_for_attempts(8)
    children = psutil.Process(client.pid).children(recursive=True)
    # To all processes of the group, as a terminal does.
    send = os.kill if name == 'SIGKILL' else os.killpg
    send(client.pid, getattr(signal, name))
    status, _, err = finish(client)
    assert status == code, err
    assert not psutil.wait_procs(children, timeout=10)[1]
    if name != 'SIGKILL':
        assert len(campaign_lines(err)) == 1 and 'Traceback' not in '\n'.join(err)
        assert err[-1].startswith('campaign: stopped after ') and err[-1].endswith(
            '; run the same command again to continue'
        )
    begun = len(machine.attempts())
    status, _, err = finish(machine.campaign('--workers', '2', '--resume'))
    assert status == 0, err
    assert len(machine.attempts()) - begun < TRIALS
    assert results(machine.out) == undisturbed


def test_a_lost_scheduler_is_reported_in_a_line(machine, undisturbed):
    address, scheduler, _ = machine.cluster(trial_s=0.2)
    client = machine.campaign('--scheduler', address)
    machine.wait_for_attempts(8)
    scheduler.kill()
    code, _, err = finish(client)
    assert code == 1
    assert len(campaign_lines(err)) == 1 and 'Traceback' not in '\n'.join(err)
    assert 'the scheduler does not answer any more' in err[-1] and 'of 24 trials are done' in err[-1]
    assert finish(machine.campaign('--workers', '2', '--resume'))[0] == 0
    assert results(machine.out) == undisturbed


def test_a_trial_that_kills_its_workers_does_not_stop_the_others(machine, undisturbed):
    for name in ('kills_7', 'raises_3'):
        (machine.folder / name).touch()
    code, _, err = finish(machine.campaign('--workers', '2', '--ppr', '40'))
    assert code == 1
    said = campaign_lines(err)
    assert any('ZeroDivisionError: of trial 3' in line and 'SL_40_003' in line for line in said), err
    assert any('each worker that began it died' in line and 'SL_40_007' in line for line in said), err
    assert [row['trial'] for row in results(machine.out)[0]] == [
        str(trial) for trial in range(1, 13) if trial not in (3, 7)
    ]


def test_a_full_disk_on_a_worker_stops_the_campaign(machine, undisturbed):
    (machine.folder / 'disk_full_9').touch()
    code, _, err = finish(machine.campaign('--workers', '2'))
    assert code == 1
    assert len(campaign_lines(err)) == 1
    # Trial 9 of either encoder: two workers may come to it in either order.
    assert re.search(r'SL_(40|90)_009\.bag', err[-1]) and 'No space left on device' in err[-1]
    (machine.folder / 'disk_full_9').unlink()
    assert finish(machine.campaign('--workers', '2', '--resume'))[0] == 0
    assert results(machine.out) == undisturbed


@pytest.mark.parametrize('address', ['nowhere', 'tcp://127.0.0.1:{}'])
def test_an_address_without_a_scheduler_is_reported_in_a_line(machine, address):
    with socket.socket() as listener:  # that never says a word
        listener.bind(('127.0.0.1', 0))
        listener.listen()
        code, _, err = finish(machine.campaign('--scheduler', address.format(listener.getsockname()[1])))
    assert code == 1
    assert len(err) == 1 and err[0].startswith('campaign: --scheduler: given ')
