"""The budget of odometry's own error: each cause by itself is its closed form, and together they are what is found."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice.drawn_robot import WheelCause
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.odometry_answer import EDGES, MISSED, QUANTISATION, odometry_budgets
from diff_encoder_sim.base.se2 import Pose2D
from drawn_drives import LINE_M, encoder_of, line, robot_of, rolled
from encoder_drives import SEPARATION_M, m_per_pulse

PPR = 360
FAST = {'speed': 2.0, 'acceleration': 2.0}
ACROSS = 1


def budget_of(encoder=None, drive=None, **errors):
    draws = DriveDraws(drive or line(LINE_M, **FAST), robot_of(**errors), 1)
    return odometry_budgets(draws, [encoder_of(PPR, encoder)])[0]


def across_variance_m2(pulses2):
    return (LINE_M * m_per_pulse(PPR) / SEPARATION_M) ** 2 * pulses2


@pytest.mark.parametrize(
    ('cause', 'encoder', 'errors', 'variance_m2'),
    [
        (QUANTISATION, {}, {}, across_variance_m2(1 / 6)),
        (EDGES, {'edge_error': 0.3}, {}, across_variance_m2(2 * 0.3**2)),
        (
            MISSED,
            {'faults': {'missed': 0.01}},
            {},
            LINE_M**3 / 3 * 2 * m_per_pulse(PPR) * 0.01 * 0.99 / SEPARATION_M**2,
        ),
        (WheelCause.SLIP.value, {}, {'slip_noise': 1e-6}, LINE_M**3 / 3 * 2 * 1e-6 / SEPARATION_M**2),
        (WheelCause.RADIUS.value, {}, {'radius_spread': 1e-4}, 2 * (LINE_M**2 * 1e-4 / (2 * SEPARATION_M)) ** 2),
    ],
    ids=['quantisation', 'edges', 'missed', 'slip', 'radius'],
)
def test_a_cause_by_itself_is_its_closed_form(cause, encoder, errors, variance_m2):
    part = budget_of(encoder, **errors).parts[cause]
    assert part.variance[ACROSS] == pytest.approx(variance_m2, rel=0.15)


def test_a_radius_that_is_off_is_a_bias():
    part = budget_of(left_radius_error=1e-4).parts[WheelCause.RADIUS.value]
    assert part.bias[ACROSS] == pytest.approx(LINE_M**2 * 1e-4 / (2 * SEPARATION_M), rel=1e-3)
    assert part.variance[ACROSS] == pytest.approx(0.0, abs=1e-12)


def test_a_separation_that_is_off_turns_too_far():
    budget = budget_of(drive=rolled(('turns', 1.0)), wheel_separation_error=0.01)
    assert budget.parts[WheelCause.SEPARATION.value].bias[2] == pytest.approx(0.02 * math.pi)


def test_what_there_is_none_of_is_left_out():
    assert list(budget_of().parts) == [QUANTISATION, WheelCause.CONTACT.value]


def test_contact_is_the_simulators():
    drive = line(**FAST)
    slipped = drive._replace(rolled=drive.rolled._replace(end=Pose2D(LINE_M, 0.001, 0.0)))
    part = budget_of(drive=slipped, slip_noise=1e-6).parts[WheelCause.CONTACT.value]
    assert part.bias == pytest.approx([0.0, -0.001, 0.0], abs=1e-9)
    assert part.variance == pytest.approx(0.0, abs=1e-12)


def test_causes_add_up_to_what_is_found():
    budget = budget_of(
        {'edge_error': 0.2, 'faults': {'missed': 0.001}},
        slip_noise=1e-7,
        radius_spread=5e-5,
        left_radius_error=1e-4,
        wheel_separation_spread=0.001,
    )
    assert len(budget.parts) == 7
    assert np.all(np.abs(budget.rest.variance) < 0.15 * budget.found.variance + 1e-12)
    assert np.all(np.abs(budget.rest.bias) < 0.1 * budget.found.std + 1e-6)
