"""The campaign command on real Dask processes: every trial ends up once, whatever dies.

Trials take no time (campaign_trials.py); what a trial computes has tests of its own.
"""

import csv
import json
import os
import re
import signal
import socket
import time
from collections import Counter

import psutil
import pytest

from campaign_processes import HERE, TRIALS, Machine, campaign_lines, finish, results, wait_until, workers_of
from places import ROOT

pytestmark = pytest.mark.timeout(300)


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


def test_each_trial_has_a_row_and_a_bag(undisturbed):
    rows, bags = undisturbed
    assert [(row['ppr'], int(row['trial'])) for row in rows] == [
        (ppr, trial) for ppr in ('40', '90') for trial in range(1, 13)
    ]
    assert Counter(row['outcome'] for row in rows) == {'succeeded': 20, 'timed_out': 4}
    assert sorted('bags/' + name for name in bags) == sorted(row['bag'] for row in rows)


def test_names_that_a_spreadsheet_executes_are_quoted_and_read_back(machine):
    names = ['=1+1', '@SUM(A1)', '-2+3|x']
    content = {'name': '=c', 'tests': ['SL'], 'ppr': [40], 'trials': 2, 'record': 'none'}
    (machine.folder / 'own.yaml').write_text(json.dumps({**content, 'variants': {name: {} for name in names}}))
    command = HERE / 'campaign_trials.py', '--config', 'own.yaml', '--out', machine.out
    assert finish(machine.start(*command))[0] == 0
    with open(str(machine.out / 'trials.csv'), newline='') as file:
        assert [row['variant'] for row in csv.DictReader(file)] == [f"'{name}" for name in names for _ in range(2)]
    code, out, err = finish(machine.start(*command))
    assert (code, len(machine.attempts())) == (0, 6), err
    assert [name for name in names if f' {name} ' in '\n'.join(out)] == names
    code, _, err = finish(machine.start(ROOT / 'scripts' / 'analyze', machine.out))
    assert code == 0, err
    tables = list((machine.out / 'analysis' / 'tables').glob('*.csv'))
    assert any("'=1+1" in path.read_text() for path in tables)
    for path in tables:
        with open(str(path), newline='') as file:
            cells = [cell for row in csv.reader(file) for cell in row if cell[:1] in ('=', '@', '+', '-')]
        assert all(re.fullmatch(r'-(inf|[\d.]+(e-\d+)?)( \(.* to .*\).*)?', cell) for cell in cells), cells


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


def test_a_worker_killed_while_it_starts_is_started_again(machine, undisturbed):
    client = machine.campaign('--workers', '1')
    wait_until(lambda: workers_of(client))
    workers_of(client)[0].kill()
    code, _, err = finish(client)
    assert code == 0, err
    assert campaign_lines(err) == ['campaign: a worker process ended while it started: trying again']
    assert 'Traceback' not in '\n'.join(err)
    assert results(machine.out) == undisturbed


def test_a_host_where_no_worker_starts_is_reported_in_a_line(machine):
    client = machine.campaign('--workers', '2')
    while client.poll() is None:
        for worker in workers_of(client):
            worker.kill()
        time.sleep(0.02)
    code, _, err = finish(client)
    assert code == 1
    assert campaign_lines(err)[-1] == (
        'campaign: no worker process starts on this host; 0 of 24 trials are done; '
        'run the same command again to continue'
    )
    assert len(campaign_lines(err)) == 6 and 'Traceback' not in '\n'.join(err)


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
    if name != 'SIGKILL':  # after which Python itself reports that it removes semaphores
        assert 'leaked' not in '\n'.join(err)
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
