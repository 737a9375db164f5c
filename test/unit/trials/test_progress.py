"""The progress of a campaign, the time that it still takes, and its outcome."""

import io
from types import SimpleNamespace

import pytest

from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials import progress as progress_module
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.progress import ASSUMED_FOR_S, ASSUMED_SPEED, Progress, outcome_table, shortest_drive_s
from diff_encoder_sim.trials.trials_csv import TrialRow
from places import CONFIG, ROOT

SL_S, DLD_S = (shortest_drive_s(load_test(name, CONFIG), 'embedded') for name in ('SL', 'DLD'))


@pytest.fixture(scope='module')
def paper():
    return load_campaign('paper', ROOT)


def row(outcome=Outcome.SUCCEEDED, test='SL', ppr='40', varied=(), wall_time_s=1.0):
    return TrialRow(test, ppr, varied, 1, 1, outcome, '', 50.0, {}, 20.0, wall_time_s, '')


@pytest.fixture
def clock(monkeypatch):
    clock = SimpleNamespace(now_s=0.0)
    monkeypatch.setattr(progress_module, 'time', SimpleNamespace(monotonic=lambda: clock.now_s))
    return clock


def begun(paper, pending, done=(), is_terminal=False):
    """Progress of a number of trials of SL, after results of earlier runs, and the stream of its lines."""
    stream = io.StringIO()
    stream.isatty = lambda: is_terminal
    return Progress(stream, paper, paper.trials()[:1] * pending, list(done)), stream


def test_lines_are_printed_at_once_with_the_first_worker_and_then_as_trials_end_or_time_passes(paper, clock):
    progress, stream = begun(paper, 10)
    for clock.now_s in range(5):
        progress.tick(0 if clock.now_s < 2 else 2)
    progress.add(row(Outcome.COLLISION))
    first, second, third = stream.getvalue().splitlines()
    assert first == '0 of 10 trials, 0 failed, waiting for workers to start'
    assert second.startswith('0 of 10 trials, 0 failed, 2 workers, about 00:0')
    assert third.startswith('1 of 10 trials, 1 failed, 2 workers, 12 x real time, about 00:0')
    progress, stream = begun(paper, 200)
    progress.tick(1)
    for _ in range(200):
        progress.add(row())
    assert [int(line.split()[0]) for line in stream.getvalue().splitlines()] == [0, *range(20, 201, 20)]
    assert stream.getvalue().endswith('about 00:00 left\n')
    progress, stream = begun(paper, 1000)
    for clock.now_s in range(100):
        progress.tick(3)
    assert len(stream.getvalue().splitlines()) == 4


def test_trials_of_earlier_runs_count_but_not_for_speed_and_a_terminal_gets_a_bar(paper, clock):
    progress, stream = begun(paper, 1, [row(), row(Outcome.LOST)], is_terminal=True)
    with progress:
        clock.now_s = 4.0
        progress.tick(1)
        progress.add(row())
    assert progress.done_now == 1
    assert progress.text().startswith('3 of 3 trials, 1 failed, 1 worker, 12 x real time, about ')
    last = stream.getvalue().split('\r')[-1]
    assert last.startswith('100% |') and progress.text() in last


def test_outcomes_are_counted_by_cell():
    rows = [row(), row(Outcome.LOST), row(), row(ppr='90'), row(Outcome.COLLISION, 'SMT', '90')]
    assert [line.split() for line in outcome_table(rows).splitlines()[2:]] == [
        ['SL', '40', '3', '2', '0', '1'],
        ['SL', '90', '1', '1', '0', '0'],
        ['SMT', '90', '1', '0', '1', '0'],
    ]
    assert outcome_table(rows).split()[:6] == ['test', 'counts', 'trials', 'succeeded', 'collision', 'lost']
    rows = [row(varied=(('simulator.lidar.noise', text),)) for text in ('0.01', '0.03', '0.03')]
    table = [line.split() for line in outcome_table(rows).splitlines()]
    assert table[0][:3] == ['test', 'simulator.lidar.noise', 'counts']
    assert table[2:] == [['SL', '0.01', '40', '1', '1'], ['SL', '0.03', '40', '2', '2']]


def test_a_drive_takes_its_length_at_its_speed():
    smt_s = [shortest_drive_s(load_test('SMT', CONFIG), nav) for nav in ('embedded', 'scripted')]
    assert (SL_S, DLD_S, *smt_s) == pytest.approx((20.0 / 0.45, 95.0 / 0.45, 31.4, 31.4), rel=0.05)


def test_the_first_guess_is_of_the_right_size_and_measured_trials_replace_it(paper):
    """The paper's campaign took 6 minutes on two cores."""
    progress = Progress(io.StringIO(), paper, paper.trials())
    progress.tick(2)
    guess_s = progress.left_s()
    assert 4 * 60 < guess_s < 8 * 60
    progress.add(row(wall_time_s=6.0))  # it waited for machine code
    assert guess_s < progress.left_s() < 3 * guess_s
    for speed in (5.0, 500.0):
        progress, _ = begun(paper, 1010)
        for _ in range(1000):
            progress.add(row(wall_time_s=SL_S / speed))
        assert progress.left_s() == pytest.approx(10 * SL_S / speed, rel=0.2)
    work_s, driven_s = ASSUMED_FOR_S + 100.0, ASSUMED_FOR_S * ASSUMED_SPEED + 10 * DLD_S
    progress, _ = begun(paper, 1, [row(test='DLD', wall_time_s=10.0)] * 10)
    assert progress.left_s() == pytest.approx(SL_S * work_s / driven_s)
    progress.add(row())
    assert progress.left_s() == 0.0
