"""The time that a campaign's trials still take, from before the first on."""

import pytest

from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.progress import ASSUMED_FOR_S, ASSUMED_SPEED, TimeLeft, shortest_drive_s, time_left
from diff_encoder_sim.trials.results import TrialRow
from places import CONFIG, ROOT

DRIVES_S = {'SL': 44.0, 'DLD': 220.0}


def row(test, wall_time_s):
    return TrialRow(test, '90', (), 1, 1, Outcome.SUCCEEDED, '', 50.0, {}, 20.0, wall_time_s, '')


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


def test_before_the_first_trial_there_is_a_guess_of_the_right_size():
    """The paper's campaign took 6 minutes on two cores."""
    campaign = load_campaign('paper', ROOT)
    assert 4 * 60 < time_left(campaign, campaign.trials()).seconds(2) < 8 * 60


def test_a_slow_first_trial_does_not_make_hours():
    left = TimeLeft(DRIVES_S, ['SL'] * 120 + ['DLD'] * 120)
    guess_s = left.seconds(2)
    left.add(row('SL', 6.0))  # it waited for machine code
    assert guess_s < left.seconds(2) < 3 * guess_s


@pytest.mark.parametrize('speed', [5.0, 500.0])
def test_measured_trials_replace_the_guess(speed):
    left = TimeLeft(DRIVES_S, ['SL'] * 1000 + ['DLD'] * 10)
    for _ in range(1000):
        left.add(row('SL', 44.0 / speed))
    assert left.seconds(4) == pytest.approx(10 * 220.0 / speed / 4, rel=0.2)


def test_what_was_measured_by_an_earlier_run_counts():
    work_s, driven_s = ASSUMED_FOR_S + 100.0, ASSUMED_FOR_S * ASSUMED_SPEED + 440.0
    left = TimeLeft(DRIVES_S, ['DLD'], [row('SL', 10.0)] * 10)
    assert left.seconds(1) == pytest.approx(220.0 * work_s / driven_s)


def test_nothing_is_left_at_the_end():
    left = TimeLeft(DRIVES_S, ['SL'])
    left.add(row('SL', 1.0))
    assert left.seconds(1) == 0.0
