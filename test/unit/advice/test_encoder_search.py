"""The search for the smallest encoder, on trials whose errors are chosen."""

import pytest

from diff_encoder_sim.advice.encoder_search import CRITERIA, Advisor, Tolerance
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome
from paper_datasets import trial

LABELS = ['20', '40', '90', '360', '1024', '4096']
TOLERANCE = Tolerance(0.05, 3.0)
IN, OUT = (0.02, -0.03, 1.0), (0.02, -0.06, 1.0)


class Bench:
    """Trials of one test; which are out of tolerance in truth is a question of encoder and number."""

    def __init__(self, is_out=lambda ppr, number: False, odom=IN):
        self.is_out, self.odom = is_out, odom
        self.asked = []

    def trials_with(self, label, count):
        self.asked.append((label, count))
        return [
            trial('SL', label, number, odom=self.odom, world=OUT if self.is_out(int(label), number) else IN)
            for number in range(1, count + 1)
        ]

    def advisor(self, looks=(30, 60), tolerance=TOLERANCE):
        return Advisor(LABELS, looks, tolerance, self.trials_with)


@pytest.mark.parametrize('label', LABELS)
def test_the_smallest_is_found_by_halves(label):
    bench = Bench(lambda ppr, number: ppr < int(label))
    assert bench.advisor().smallest(PoseSource.WORLD) == label
    assert len(bench.asked) <= 4  # the largest, and log2 of six


def test_there_is_none_where_the_largest_does_not_reach():
    bench = Bench(lambda ppr, number: True)
    assert bench.advisor().smallest(PoseSource.WORLD) is None
    assert bench.asked == [('4096', 30)]


def test_a_source_without_poses_reaches_nothing():
    assert Bench().advisor().smallest(PoseSource.GLOBAL) is None


def test_more_trials_are_run_where_few_do_not_tell():
    # 28 of 30 cannot show 80 %, 56 of 60 can.
    bench = Bench(lambda ppr, number: number % 15 == 0)
    assert bench.advisor().smallest(PoseSource.WORLD) == '20'
    assert bench.asked[:2] == [('4096', 30), ('4096', 60)]


def test_what_stays_undecided_does_not_count_as_reached():
    # 50 of 60: 83 %, but 71 to 91 % with this confidence.
    advisor = Bench(lambda ppr, number: number % 6 == 0).advisor()
    assert advisor.smallest(PoseSource.WORLD) is None
    assert '50/60 ?' in advisor.table()


@pytest.mark.parametrize(('looks', 'expected'), [((30,), '29/30 yes'), ((30, 60, 90, 120), '57/60 yes')])
def test_each_look_has_its_part_of_the_doubt(looks, expected):
    # 29 of 30: from 83 % on for one look, from 78 % on for each of four.
    advisor = Bench(lambda ppr, number: number % 20 == 0).advisor(looks)
    assert advisor.smallest(PoseSource.WORLD) == '20'
    assert expected in advisor.table()


def test_trials_are_run_once_for_all_sources():
    bench = Bench()
    advisor = bench.advisor()
    for source in CRITERIA:
        advisor.smallest(source)
    assert len(bench.asked) == len(set(bench.asked))


@pytest.mark.parametrize(
    ('odom', 'smallest'),
    [
        (IN, '20'),
        ((0.08, -0.03, 1.0), None),
        ((0.02, -0.03, 4.5), None),
        ((0.06, -0.07, 3.5), '20'),
        ((0.02, -0.03, 359.0), '20'),
    ],
)
def test_drift_is_where_odometry_ended_minus_where_the_robot_did(odom, smallest):
    assert Bench(odom=odom).advisor().smallest(PoseSource.ODOM) == smallest


def test_a_robot_that_gave_up_is_not_at_its_goal_but_its_odometry_may_be_right():
    def trials_with(label, count):
        return [
            trial('SL', label, number, outcome=Outcome.TIMED_OUT, odom=IN, world=IN) for number in range(1, count + 1)
        ]

    advisor = Advisor(LABELS, [30], TOLERANCE, trials_with)
    assert [advisor.smallest(source) for source in CRITERIA] == [None, None, '20']


def test_the_tolerance_is_the_users():
    bench = Bench(lambda ppr, number: True)
    assert bench.advisor(tolerance=Tolerance(0.07, 3.0)).smallest(PoseSource.WORLD) == '20'
    assert bench.advisor(tolerance=Tolerance(0.07, 0.5)).smallest(PoseSource.WORLD) is None


def test_every_test_must_reach():
    def trials_with(label, count):
        return [
            trial(test, label, number, world=error)
            for number in range(1, count + 1)
            for test, error in (('SL', IN), ('SMT', IN if int(label) >= 360 else OUT))
        ]

    advisor = Advisor(LABELS, [30], TOLERANCE, trials_with)
    assert advisor.smallest(PoseSource.WORLD) == '360'
    lines = advisor.table().splitlines()
    assert [line.split()[0] for line in lines[2:]] == ['SL'] * 3 + ['SMT'] * 3


def test_of_real_encoders_all_that_are_sufficient_are_found():
    """More counts need not be better."""
    asked = []

    def trials_with(label, count):
        asked.append(label)
        is_in = label in ('90 hoverboard_hub', '8192 amt102')
        return [trial('SL', label, number, world=IN if is_in else OUT) for number in range(1, count + 1)]

    advisor = Advisor(['90 hoverboard_hub', '4096 as5600', '8192 amt102'], [30], TOLERANCE, trials_with)
    assert advisor.sufficient(PoseSource.WORLD) == ['90 hoverboard_hub', '8192 amt102']
    assert advisor.sufficient(PoseSource.GLOBAL) == [] and len(asked) == 3
    assert 'amt102 (8192 counts)' in advisor.table()
