"""The campaign command on real processes: every trial ends up once, whatever dies.

Trials take no time (campaign_trials.py); tests of what a trial computes are in test/unit/trials.
"""

import contextlib
import csv
import json
import os
import random
import re
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from itertools import product
from pathlib import Path

import campaign_trials
import psutil
import pytest
from distributed import Client

pytestmark = pytest.mark.timeout(300)

HERE = Path(__file__).parent
TRIALS = 24
ARGUMENTS = ['--config', 'paper', '--tests', 'SL', '--ppr', '40', '90', '--trials', '12']
PATIENCE_S = 100.0
# As in docs/campaigns.md.
OPENSSL = 'openssl req -x509 -newkey rsa:2048 -nodes -days 30 -subj /CN=campaign'
VARIABLES = [f'DASK_DISTRIBUTED__COMM__TLS__{name}' for name in ('CA_FILE', 'CLIENT__CERT', 'CLIENT__KEY')]
SCRIPTED = ('--nav', 'scripted', '--ppr', '40', '90', '1024', '--trials', '4')


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

    def start(self, *command, trial_s=0.0, **variables):
        environment = {
            **os.environ,
            'PYTHONPATH': os.pathsep.join([str(HERE), *filter(None, sys.path)]),
            campaign_trials.FOLDER: str(self.folder),
            campaign_trials.TRIAL_S: str(trial_s),
            **variables,
        }
        pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'start_new_session': True}
        process = subprocess.Popen([sys.executable, *map(str, command)], env=environment, cwd=self.folder, **pipes)
        self.processes.append(process)
        return process

    def campaign(self, *arguments, **options):
        return self.start(HERE / 'campaign_trials.py', *ARGUMENTS, '--out', self.out, *arguments, **options)

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


@pytest.fixture
def machine(tmp_path):
    with Machine(tmp_path) as machine:
        yield machine


@pytest.fixture(scope='module')
def undisturbed(tmp_path_factory):
    with Machine(tmp_path_factory.mktemp('undisturbed')) as machine:
        code, out, err = finish(machine.campaign('--workers', '1'))
        assert (code, out[0]) == (0, str(machine.out / 'trials.csv'))
        assert '24 of 24 trials, 4 failed' in err[-1]
        rows, bags = results(machine.out)
    assert [(row['ppr'], int(row['trial'])) for row in rows] == list(product(('40', '90'), range(1, 13)))
    assert Counter(row['outcome'] for row in rows) == {'succeeded': 20, 'timed_out': 4}
    assert sorted('bags/' + name for name in bags) == sorted(row['bag'] for row in rows)
    return rows, bags


def test_on_one_machine_there_is_no_port_and_killed_workers_are_replaced(machine, undisturbed):
    client = machine.campaign('--workers', '2', trial_s=0.1)
    wait_until(lambda: workers_of(client))
    workers_of(client)[0].kill()  # while it starts
    wait_until(lambda: len(dict(machine.attempts())) == 2)
    process = psutil.Process(client.pid)
    connections = [each for one in (process, *process.children(True)) for each in one.net_connections('inet')]
    assert [each for each in connections if each.status == psutil.CONN_LISTEN] == []
    for process_id in dict(machine.attempts()):
        os.kill(process_id, signal.SIGKILL)
    code, _, err = finish(client)
    assert (code, campaign_lines(err)) == (0, ['campaign: a worker process ended while it started: trying again'])
    assert len({process for process, _ in machine.attempts()}) >= 3
    assert results(machine.out) == undisturbed


def test_a_host_on_which_no_worker_starts_is_reported(machine):
    client = machine.campaign('--workers', '2')
    while client.poll() is None:
        for worker in workers_of(client):
            worker.kill()
        time.sleep(0.02)
    code, _, err = finish(client)
    assert code == 1 and 'Traceback' not in '\n'.join(err)
    assert 'no worker process starts on this host; 0 of 24 trials are done' in campaign_lines(err)[-1]


@pytest.mark.parametrize(('name', 'code'), [('SIGINT', 130), ('SIGTERM', 143)])
def test_a_stopped_client_leaves_no_process_and_can_be_resumed(machine, undisturbed, name, code):
    client = machine.campaign('--workers', '2', trial_s=0.2)
    machine.wait_for_attempts(8)
    children = psutil.Process(client.pid).children(recursive=True)
    os.killpg(client.pid, getattr(signal, name))  # to all processes of the group, as a terminal does
    status, _, err = finish(client)
    assert status == code and not psutil.wait_procs(children, timeout=10)[1]
    assert 'leaked' not in '\n'.join(err) and 'Traceback' not in '\n'.join(err)
    (line,) = campaign_lines(err)
    assert re.match(r'campaign: stopped after \d+ of 24 trials; run the same command again to continue', line)
    begun = len(machine.attempts())
    assert finish(machine.campaign('--workers', '3', '--resume'))[0] == 0
    assert len(machine.attempts()) - begun < TRIALS
    assert results(machine.out) == undisturbed


def test_kills_of_the_client_and_its_workers_at_random_moments_change_nothing(machine, undisturbed):
    rng = random.Random(1)
    for kill in range(3):
        client = machine.campaign('--workers', '2', trial_s=0.1)
        wait_until(lambda: machine.out.exists() and (kill == 0 or client.poll() is not None or workers_of(client)))
        time.sleep(rng.uniform(0.0, 2.0))
        children = psutil.Process(client.pid).children(recursive=True) if client.poll() is None else []
        for victim in rng.sample(children, min(1, len(children))):
            victim.kill()
        client.kill()
        finish(client)
        assert not psutil.wait_procs(children, timeout=10)[1]
    assert finish(machine.campaign('--workers', '2'))[0] == 0
    assert results(machine.out) == undisturbed


def test_a_full_disk_on_a_worker_stops_the_campaign(machine, undisturbed):
    (machine.folder / 'disk_full_9').touch()
    code, _, err = finish(machine.campaign('--workers', '2'))
    (line,) = campaign_lines(err)
    # Trial 9 of either encoder: two workers may run it in either order.
    assert code == 1 and re.search(r'SL_(40|90)_009\.bag.*No space left on device', line)
    (machine.folder / 'disk_full_9').unlink()
    assert finish(machine.campaign('--workers', '2', '--resume'))[0] == 0
    assert results(machine.out) == undisturbed


def begun(machine):
    """The trials that were begun together, in alphabetical order."""
    return sorted((machine.folder / campaign_trials.GROUPS).read_text().splitlines())


def test_trials_that_differ_in_the_encoder_run_together_and_so_does_the_rest_of_a_drive(machine):
    code, _, err = finish(machine.campaign('--workers', '2', *SCRIPTED))
    assert (code, campaign_lines(err)) == (0, [])
    assert begun(machine) == [f'{trial}_40 {trial}_90 {trial}_1024' for trial in range(1, 5)]
    rows, bags = whole = results(machine.out)
    assert [(row['ppr'], int(row['trial'])) for row in rows] == list(product(('40', '90', '1024'), range(1, 5)))
    assert len(bags) == 12
    for name in ('SL_40_003.bag', 'SL_1024_003.bag', 'SL_90_004.bag'):  # a trial without its bag is not done
        (machine.out / 'bags' / name).unlink()
    (machine.folder / campaign_trials.GROUPS).unlink()
    assert finish(machine.campaign('--workers', '1', '--resume', *SCRIPTED))[0] == 0
    assert begun(machine) == ['3_40 3_1024', '4_90']
    assert results(machine.out) == whole


@pytest.mark.parametrize(
    ('fault', 'reason'),
    [('raises_2_90', 'ZeroDivisionError: of trial 2'), ('kills_2_90', 'each worker that began it died')],
)
def test_a_trial_that_fails_is_found_and_the_others_of_its_drive_are_run(machine, fault, reason):
    (machine.folder / fault).touch()
    code, _, err = finish(machine.campaign('--workers', '2', *SCRIPTED))
    (line,) = [line for line in campaign_lines(err) if 'could not be run' in line]
    assert (code, line) == (1, f'campaign: 1 trial could not be run ({reason}): SL_90_002')
    assert len(results(machine.out)[0]) == 11
    assert {'2_40', '2_90', '2_1024'} <= set(begun(machine))  # each separately
    (machine.folder / fault).unlink()
    assert finish(machine.campaign('--workers', '2', '--resume', *SCRIPTED))[0] == 0
    assert len(results(machine.out)[0]) == 12


def test_a_worker_killed_in_mid_campaign_costs_no_trial_and_folders_need_not_be_shared(machine, undisturbed):
    address, _, workers = machine.cluster(trial_s=0.1, preload=('--preload', HERE / 'campaign_blind_worker.py'))
    client = machine.campaign('--scheduler', address)
    wait_until(lambda: len(machine.attempts()) >= 6 and workers[0].pid in dict(machine.attempts()))
    workers[0].kill()
    code, _, err = finish(client)
    assert (code, campaign_lines(err)) == (0, [])
    assert len(machine.attempts()) > TRIALS  # its unfinished trials were begun again
    assert results(machine.out) == undisturbed
    assert not list((machine.folder / 'scratch').rglob('*.bag*'))


def test_a_lost_scheduler_is_reported(machine, undisturbed):
    address, scheduler, _ = machine.cluster(trial_s=0.2)
    client = machine.campaign('--scheduler', address)
    machine.wait_for_attempts(8)
    scheduler.kill()
    code, _, err = finish(client)
    (line,) = campaign_lines(err)
    assert code == 1 and 'Traceback' not in '\n'.join(err)
    assert 'the scheduler does not answer any more' in line and 'of 24 trials are done' in line
    assert finish(machine.campaign('--workers', '2', '--resume'))[0] == 0
    assert results(machine.out) == undisturbed


@pytest.mark.parametrize('address', ['nowhere', 'tcp://127.0.0.1:{}'])
def test_an_address_without_a_scheduler_is_reported(machine, address):
    with socket.socket() as listener:  # that never answers
        listener.bind(('127.0.0.1', 0))
        listener.listen()
        code, _, (line,) = finish(machine.campaign('--scheduler', address.format(listener.getsockname()[1])))
    assert code == 1 and line.startswith('campaign: --scheduler: given ')


def test_a_cluster_with_certificates_accepts_a_client_that_has_one(machine, tmp_path):
    cert, key = str(tmp_path / 'cert.pem'), str(tmp_path / 'key.pem')
    subprocess.run([*OPENSSL.split(), '-keyout', key, '-out', cert], check=True, capture_output=True)
    address, _, _ = machine.cluster(1, tls=('--tls-ca-file', cert, '--tls-cert', cert, '--tls-key', key))
    assert address.startswith('tls://')
    code, _, (line,) = finish(machine.campaign('--scheduler', address))
    assert code == 1 and line.startswith('campaign: --scheduler: given ')
    settings = dict(zip(VARIABLES, (cert, cert, key)))
    assert finish(machine.campaign('--scheduler', address, **settings))[0] == 0
    assert len(results(machine.out)[0]) == TRIALS
