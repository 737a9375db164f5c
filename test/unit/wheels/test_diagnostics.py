"""What the nodes of the wheels report on /diagnostics."""

import math

import numpy as np
import pytest

from diff_encoder_sim.wheels.diagnostics import (
    EncoderDiagnosis,
    FollowingError,
    OdometryDiagnosis,
    ReportRate,
    encoder_lateral_std,
    hidden_encoder,
)
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

PERIOD_S, PERIOD_NS = 0.05, 50_000_000

TIMEOUT_S = 1.0


def followed(legs, ppr=40):
    """How long errors last [s], and how large they are, after each leg (seconds, commanded, turning) of both wheels."""
    rad_per_count = 2 * math.pi / ppr
    watches = [FollowingError(rad_per_count, 1.0, TIMEOUT_S) for _ in range(2)]
    angles, index = np.array([0.3, 0.1]), 0
    for seconds, commanded, turning in legs:
        for _ in range(round(seconds / PERIOD_S)):
            index, angles = index + 1, angles + np.multiply(turning, PERIOD_S)
            for side, (watch, count) in enumerate(zip(watches, np.floor(angles / rad_per_count).astype(int).tolist())):
                if commanded is not None:
                    watch.take_command(commanded[side])
                watch.take_report(index * PERIOD_NS, count)
        yield (*(watch.lasts_s for watch in watches), *(watch.error_radps for watch in watches))


@pytest.mark.parametrize('ppr', [12, 40, 4096])
@pytest.mark.parametrize('speed', [0.0, 0.2, 4.5, -4.5])
def test_wheels_that_follow_have_no_error_whatever_the_resolution(ppr, speed):
    assert {each[:2] for each in followed([(0.1, (speed, -speed), (speed, -speed))] * 100, ppr)} == {(0.0, 0.0)}


BOTH = (4.5, 4.5)


def test_a_wheel_that_does_not_follow_is_noticed_after_the_timeout_and_forgotten_when_it_turns_again():
    blocked = (1.0, BOTH, (0.0, 4.5))
    well, at_once, later, again = followed([(2.0, BOTH, BOTH), blocked, blocked, (1.0, BOTH, BOTH)])
    assert well[:2] == at_once[:2] == again[:2] == (0.0, 0.0)
    assert 1.7 < later[0] <= 2.0 and later[1] == 0.0
    assert later[2:] == pytest.approx((-4.5, 0.0), abs=2 * math.pi / 40 / 0.25)
    assert next(followed([(3.0, (2.0, 2.0), (2.0, -2.0))]))[1] > 2.0  # counts the wrong way
    uncommanded = [(3.0, None, BOTH), (1.0, BOTH, BOTH), (5.0, None, (0.0, 0.0))]
    assert {each[:2] for each in followed(uncommanded)} == {(0.0, 0.0)}


@pytest.mark.parametrize('probability', [0.0, 0.01, 0.2, 0.8])
@pytest.mark.parametrize(('jitter', 'skew'), [(0.0, 0.0), (0.4, 0.0), (0.0, -3e-3), (0.0, 3e-3)])
def test_each_gap_counts_as_many_as_are_missing_but_jitter_and_a_slow_or_fast_clock_are_no_loss(
    probability, jitter, skew
):
    rng, rate = np.random.default_rng(1), ReportRate(20.0)
    came = np.flatnonzero(rng.random(2000) >= probability)
    for stamp_ns in (came * (1.0 + skew) + rng.uniform(0.0, jitter, len(came))) * PERIOD_NS:
        rate.take(int(stamp_ns), 0, 0)
    tolerated = 8 if probability and (jitter or skew) else 0
    assert abs(rate.lost - (came[-1] - came[0] + 1 - len(came))) <= tolerated


def test_counts_and_reports_per_second_and_what_was_dropped():
    diagnosis = EncoderDiagnosis(EncoderParams(counter_modulus=256))
    for index in range(41):
        diagnosis.take_report(EncoderSample(index * 50_000_000, (5 * index + 128) % 256 - 128, -index))
    diagnosis.take_fault()
    per_second = {'counts per second, left': 100.0, 'counts per second, right': -20.0, 'reports per second': 20.0}
    assert diagnosis.diagnose() == ('dropped joint messages: 1', {**per_second, 'dropped joint messages': 1})
    assert diagnosis.diagnose().warning == ''


PPR = 100


class Node:
    """An odometry and its diagnosis, fed as the node feeds them."""

    def __init__(self):
        self.odometry = WheelOdometry(OdometryParams(ppr=PPR))
        self.diagnosis = OdometryDiagnosis(self.odometry, 20.0)
        self.index = 0

    def drive(self, reports, zero=0, command=None):
        """Four counts a report: 5.03 rad/s, 0.503 m/s."""
        for _ in range(reports):
            if command is not None:
                self.diagnosis.take_command(*command)
            stamp_ns, count = self.index * PERIOD_NS, 4 * (self.index - zero)
            self.diagnosis.take_report(stamp_ns, self.odometry.update(stamp_ns, count, count) is not None)
            self.index += 1
        return self.diagnosis.diagnose()


SPEED_MPS = 80 * math.pi * 0.2 / PPR


def test_all_is_well_in_an_ordinary_drive():
    warning, values = Node().drive(60, command=(SPEED_MPS, 0.0))
    assert warning == ''
    sides = {f'counts per second, {side}': 80.0 for side in ('left', 'right')}
    errors = {f'following error, {side} [rad/s]': 0.0 for side in ('left', 'right')}
    none = dict.fromkeys(('lost reports', 'late or repeated reports', 'counter restarts'), 0)
    assert values == pytest.approx({**sides, 'reports per second': 20.0, **none, **errors}, abs=1e-9)


def test_each_event_is_warned_of_once_and_stays_counted():
    node = Node()
    node.drive(30)
    node.index += 3
    warning, values = node.drive(30)
    assert warning == 'lost reports: 3' and values['lost reports'] == 3
    warning, values = node.drive(20, zero=node.index)
    assert warning == 'counter restarts: 1' and (values['counter restarts'], values['lost reports']) == (1, 3)
    assert node.drive(20, zero=node.index).warning == 'counter restarts: 1'


def test_wheels_that_do_not_follow_a_turn_in_place_are_named_for_as_long():
    """It commands them against each other: by half the separation, 0.2 m."""
    node = Node()
    node.drive(30, command=(SPEED_MPS, 0.0))
    warning, values = node.drive(60, command=(0.0, 4.0))
    assert warning == '; '.join(
        f'{side} wheel has not followed the command for {lasts} s' for side, lasts in (('left', 3.0), ('right', 2.9))
    )
    turned_radps = 80 * 2 * math.pi / PPR
    assert values['following error, left [rad/s]'] == pytest.approx(turned_radps + 8.0)
    assert values['following error, right [rad/s]'] == pytest.approx(turned_radps - 8.0)


def test_the_usual_motion_noise_hides_a_fine_encoder():
    m_per_pulse = math.pi * 0.2 / 90
    assert encoder_lateral_std(OdometryParams(ppr=90)) == pytest.approx(20 * m_per_pulse / 0.4 / math.sqrt(6), rel=1e-4)
    assert hidden_encoder(OdometryParams(ppr=40)) == ''  # 321 mm
    assert 'it states 183 mm across for slip of 1e-06 m^2/m' in hidden_encoder(OdometryParams(ppr=90))
