"""The progress of a campaign, the time that it still takes, and its outcome."""

import io

import pytest

from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.progress import (
    ASSUMED_FOR_S,
    ASSUMED_SPEED,
    Progress,
    TimeLeft,
    outcome_table,
    shortest_drive_s,
    time_left,
)
from diff_encoder_sim.trials.trials_csv import TrialRow
from places import CONFIG, ROOT

DRIVES_S = {'SL': 44.0, 'DLD': 220.0}


class Clock:
    """Seconds that pass when a test lets them."""

    now_s = 0.0

    def __call__(self):
        return self.now_s


class Left:
    """A minute for one worker, whatever happens."""

    def add(self, row):
        pass

    def seconds(self, workers):
        return 60.0 / workers


def row(outcome=Outcome.SUCCEEDED, test='SL', ppr='40', varied=(), wall_time_s=1.0):
    return TrialRow(test, ppr, varied, 1, 1, outcome, '', 50.0, {}, 20.0, wall_time_s, '')


def lines_of(total, done=()):
    clock, stream = Clock(), io.StringIO()
    return clock, stream, Progress(stream, total, list(done), Left(), clock)


def test_the_first_lines_are_printed_at_once_and_with_the_first_worker():
    clock, stream, progress = lines_of(10)
    for clock.now_s in range(5):
        progress.tick(0 if clock.now_s < 2 else 2)
    progress.add(row(Outcome.COLLISION))
    assert stream.getvalue().splitlines() == [
        '0 of 10 trials, 0 failed, waiting for workers to start',
        '0 of 10 trials, 0 failed, 2 workers, about 00:30 left',
        '1 of 10 trials, 1 failed, 2 workers, 12 x real time, about 00:30 left',
    ]


def test_trials_of_earlier_runs_count_but_not_for_speed():
    clock, _, progress = lines_of(10, [row(), row(Outcome.LOST), row(), row(), row()])
    clock.now_s = 4.0
    progress.tick(1)
    progress.add(row())
    assert progress.done_now == 1
    assert progress.text() == '6 of 10 trials, 1 failed, 1 worker, 12 x real time, about 01:00 left'


def test_lines_follow_every_tenth_of_the_trials_and_every_thirty_seconds():
    _, stream, progress = lines_of(200)
    progress.tick(1)
    for _ in range(200):
        progress.add(row())
    assert [int(line.split()[0]) for line in stream.getvalue().splitlines()] == [0, *range(20, 201, 20)]
    clock, stream, progress = lines_of(1000)
    for clock.now_s in range(100):
        progress.tick(3)
    assert stream.getvalue().count('0 of 1000 trials, 0 failed, 3 workers, about 00:20 left\n') == 4


def test_a_terminal_gets_a_bar_with_the_same_text():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    stream = Terminal()
    with Progress(stream, 4, [row()], Left()) as progress:
        for _ in range(3):
            progress.add(row(Outcome.TIMED_OUT))
    shown = stream.getvalue()
    assert '100% |' in shown
    assert '4 of 4 trials, 3 failed' in shown.split('\r')[-1]


def test_outcomes_are_counted_by_cell():
    rows = [row(), row(Outcome.LOST), row(), row(ppr='90'), row(Outcome.COLLISION, 'SMT', '90')]
    assert [line.split() for line in outcome_table(rows).splitlines()[2:]] == [
        ['SL', '40', '3', '2', '0', '1'],
        ['SL', '90', '1', '1', '0', '0'],
        ['SMT', '90', '1', '0', '1', '0'],
    ]
    assert outcome_table(rows).split()[:6] == ['test', 'PPR', 'trials', 'succeeded', 'collision', 'lost']
    rows = [row(varied=(('simulator.lidar.noise', text),)) for text in ('0.01', '0.03', '0.03')]
    table = [line.split() for line in outcome_table(rows).splitlines()]
    assert table[0][:3] == ['test', 'simulator.lidar.noise', 'PPR']
    assert table[2:] == [['SL', '0.01', '40', '1', '1'], ['SL', '0.03', '40', '2', '2']]


@pytest.mark.parametrize(
    ('name', 'nav', 'expected_s'),
    [
        ('SL', 'embedded', 20.0 / 0.45),
        ('SL', 'scripted', 20.0 / 0.45),
        ('SMT', 'embedded', 31.4),
        ('SMT', 'scripted', 31.4),
        ('DLD', 'embedded', 95.0 / 0.45),
    ],
)
def test_a_drive_takes_its_length_at_its_speed(name, nav, expected_s):
    assert shortest_drive_s(load_test(name, CONFIG), nav) == pytest.approx(expected_s, rel=0.05)


def test_the_first_guess_is_of_the_right_size_and_a_slow_first_trial_does_not_make_hours():
    """The paper's campaign took 6 minutes on two cores."""
    campaign = load_campaign('paper', ROOT)
    assert 4 * 60 < time_left(campaign, campaign.trials()).seconds(2) < 8 * 60
    left = TimeLeft(DRIVES_S, ['SL'] * 120 + ['DLD'] * 120)
    guess_s = left.seconds(2)
    left.add(row(wall_time_s=6.0))  # it waited for machine code
    assert guess_s < left.seconds(2) < 3 * guess_s


@pytest.mark.parametrize('speed', [5.0, 500.0])
def test_measured_trials_replace_the_guess(speed):
    left = TimeLeft(DRIVES_S, ['SL'] * 1000 + ['DLD'] * 10)
    for _ in range(1000):
        left.add(row(wall_time_s=44.0 / speed))
    assert left.seconds(4) == pytest.approx(10 * 220.0 / speed / 4, rel=0.2)


def test_trials_of_an_earlier_run_are_measurements_and_at_the_end_nothing_is_left():
    work_s, driven_s = ASSUMED_FOR_S + 100.0, ASSUMED_FOR_S * ASSUMED_SPEED + 440.0
    left = TimeLeft(DRIVES_S, ['DLD'], [row(wall_time_s=10.0)] * 10)
    assert left.seconds(1) == pytest.approx(220.0 * work_s / driven_s)
    left.add(row(test='DLD'))
    assert left.seconds(1) == 0.0
