"""From how many counts on quantisation alone is within the tolerance."""

import math

import pytest

from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.advice.odometry_curve import closed_form_counts, local_counts
from diff_encoder_sim.analysis.dataset import RobotGeometry
from drawn_drives import line, rolled

ALTO = RobotGeometry(0.2, 0.4)
NORMAL_80 = 1.2816  # of all errors within +- this many standard deviations


def required(share=0.8, position_m=0.05, yaw_rad=math.radians(3.0)):
    return Requirement(share, position_m, yaw_rad, 0.95)


@pytest.mark.parametrize(('length_m', 'counts'), [(20.0, 347.3), (10.0, 173.7)])
def test_a_line_across(length_m, counts):
    assert closed_form_counts(line(length_m).requested, ALTO, required()) == pytest.approx(counts, rel=1e-3)


def test_a_line_across_is_within_as_often_as_two_phases_are():
    """P(|y| <= tol) = 1 - (1 - c)^2 with c = tol L / (S d)."""
    counts = closed_form_counts(line().requested, ALTO, required(share=0.95))
    c = 0.05 * 0.4 / (20.0 * 0.2 * math.pi / counts)
    assert 1.0 - (1.0 - c) ** 2 == pytest.approx(0.95, rel=1e-4)  # the rounding under way adds little


def test_turns_end_by_their_heading():
    """(d / L) sqrt(1/3), as normal."""
    counts = closed_form_counts(rolled(('turns', 5.0)).requested, ALTO, required(yaw_rad=0.01))
    assert counts == pytest.approx(NORMAL_80 * 0.2 * math.pi / 0.4 / math.sqrt(3.0) / 0.01, rel=1e-3)
    assert local_counts(ALTO, required(yaw_rad=0.01)) == pytest.approx(counts)
