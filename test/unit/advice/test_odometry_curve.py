"""Odometry's error over the whole range of encoders, and its closed form."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice import odometry_curve
from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.odometry_curve import OdometryCurves, closed_form_counts
from diff_encoder_sim.analysis.results_table import RobotGeometry
from drawn_drives import encoder_of, line, robot_of, rolled

ALTO = RobotGeometry(0.2, 0.4)


def required(share=0.8, position_m=0.05, yaw_rad=math.radians(3.0)):
    return Requirement(share, position_m, yaw_rad, 0.95)


def curves_of(drive, **errors):
    return OdometryCurves([DriveDraws(drive, robot_of(**errors), 1)], encoder_of(90))


def fast(length_m):
    """A straight drive of few reports."""
    return line(length_m, speed=10.0, acceleration=20.0)


@pytest.fixture(scope='module', autouse=True)
def of_20_m():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(odometry_curve, 'DRAWS', 400)
        patch.setattr(odometry_curve, 'FINE_DRAWS', 2000)
        yield curves_of(fast(20.0))


def test_20_m_take_as_many_counts_as_the_closed_form_says(of_20_m):
    smallest = of_20_m.smallest(required())
    assert closed_form_counts(line(20.0).requested, ALTO, required()) == pytest.approx(347.3, rel=1e-3)
    assert smallest.interval.low <= smallest.counts <= smallest.interval.high
    assert smallest.counts == pytest.approx(347.3, rel=0.06)
    assert smallest.interval.high < 1.3 * smallest.interval.low


def test_shares_rise_with_the_counts(of_20_m):
    """But where a few pulses are on the whole way."""
    shares = [of_20_m.share(counts, required()) for counts in of_20_m.counts if counts >= 100.0]
    assert (of_20_m.counts[0], of_20_m.counts[-1]) == (odometry_curve.FEWEST_COUNTS, odometry_curve.MOST_COUNTS)
    for lower, higher in zip(shares, shares[1:]):
        assert higher.high >= lower.low
    assert shares[-1] == odometry_curve.share_within(np.zeros((400, 3)), required())


def test_the_worst_test_decides(of_20_m):
    both = OdometryCurves([of_20_m.curves[0].draws, DriveDraws(fast(1.0), robot_of(), 1)], encoder_of(90))
    assert both.smallest(required()).counts == pytest.approx(347.3, rel=0.06)


def test_all_encoders_may_be_enough_or_none():
    assert curves_of(fast(0.5)).smallest(required(position_m=1.0, yaw_rad=4.0)).counts == odometry_curve.FEWEST_COUNTS
    assert curves_of(fast(4.0), left_radius_error=0.05).smallest(required()) is None


def test_edges_that_repeat_have_counts_that_fit():
    curves = OdometryCurves([], encoder_of(360, {'phase_error': 10.0}))
    assert curves.whole([8.0, 9.0, 11.0, 65536.0]) == [8.0, 12.0, 65536.0]


NORMAL_80 = 1.2816  # of all errors within +- this many standard deviations


def test_a_line_across_is_within_as_often_as_two_phases_are():
    """P(|y| <= tol) = 1 - (1 - c)^2 with c = tol L / (S d)."""
    counts = closed_form_counts(line().requested, ALTO, required(share=0.95))
    c = 0.05 * 0.4 / (20.0 * 0.2 * math.pi / counts)
    assert 1.0 - (1.0 - c) ** 2 == pytest.approx(0.95, rel=1e-4)  # the rounding under way adds little


def test_turns_end_by_their_heading():
    """(d / L) sqrt(1/3), as normal."""
    counts = closed_form_counts(rolled(('turns', 5.0)).requested, ALTO, required(yaw_rad=0.01))
    assert counts == pytest.approx(NORMAL_80 * 0.2 * math.pi / 0.4 / math.sqrt(3.0) / 0.01, rel=1e-3)
    assert odometry_curve.local_counts(ALTO, required(yaw_rad=0.01)) == pytest.approx(counts)
