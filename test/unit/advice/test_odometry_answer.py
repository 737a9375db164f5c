"""Odometry's error over the whole range of encoders, its closed form, answers and budgets."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice import odometry_answer as module
from diff_encoder_sim.advice.answers import MOST_BY_ONE_CAUSE, Kind, Requirement
from diff_encoder_sim.advice.drive_draws import CALIBRATED_GEOMETRY, RADIUS, SLIP, DriveDraws
from diff_encoder_sim.advice.odometry_answer import EDGES, MISSED, QUANTISATION, OdometryCurves, odometry_answer
from drawn_drives import LINE_M, calibrated, encoder_of, line, robot_of, rolled
from encoder_drives import RADIUS_M, SEPARATION_M, m_per_pulse
from trial_tables import ALTO

NORMAL_80 = 1.2816  # 80 % of all errors are within +- this many standard deviations
LENGTH_M, PPR, ACROSS = 10.0, 360, 1
NOISE_M3 = 2.0 / 3.0 * LINE_M**3 / SEPARATION_M**2  # times a variance per metre: that of a random walk of both wheels


def curves_of(drive, **errors):
    return OdometryCurves([DriveDraws(drive, robot_of(**errors), 1)], encoder_of(90))


def fast(length_m):
    """A straight drive of few reports."""
    return line(length_m, speed=10.0, acceleration=20.0)


@pytest.fixture(scope='module', autouse=True)
def of_20_m():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, 'DRAWS', 400)
        patch.setattr(module, 'FINE_DRAWS', 2000)
        yield curves_of(fast(20.0))


def test_20_m_take_as_many_counts_as_the_closed_form_says(of_20_m):
    counts, interval = of_20_m.smallest(Requirement())
    assert module.closed_form_counts(line(20.0).requested, ALTO, Requirement()) == pytest.approx(347.3, rel=1e-3)
    assert interval.low <= counts <= interval.high < 1.3 * interval.low
    assert counts == pytest.approx(347.3, rel=0.06)


def test_shares_rise_with_the_counts(of_20_m):
    """But where a few pulses are on the whole way."""
    shares = [of_20_m.share(counts, Requirement()) for counts in of_20_m.counts if counts >= 100.0]
    assert (of_20_m.counts[0], of_20_m.counts[-1]) == (module.FEWEST_COUNTS, module.MOST_COUNTS)
    for lower, higher in zip(shares, shares[1:]):
        assert higher.high >= lower.low
    assert shares[-1] == module.share_within(np.zeros((400, 3)), Requirement())


def test_the_worst_test_decides(of_20_m):
    both = OdometryCurves([of_20_m.curves[0].draws, DriveDraws(fast(1.0), robot_of(), 1)], encoder_of(90))
    assert both.smallest(Requirement())[0] == pytest.approx(347.3, rel=0.06)


def test_all_encoders_may_be_enough_or_none():
    assert curves_of(fast(0.5)).smallest(Requirement(position_m=1.0, yaw_rad=4.0))[0] == module.FEWEST_COUNTS
    assert curves_of(fast(4.0), left_radius_error=0.05).smallest(Requirement()) is None


def test_edges_that_repeat_have_counts_that_fit():
    curves = OdometryCurves([], encoder_of(360, {'phase_error': 10.0}))
    assert curves.whole([8.0, 9.0, 11.0, 65536.0]) == [8.0, 12.0, 65536.0]


def test_a_line_across_is_within_as_often_as_two_phases_are():
    """P(|y| <= tol) = 1 - (1 - c)^2 with c = tol L / (S d)."""
    counts = module.closed_form_counts(line().requested, ALTO, Requirement(share=0.95))
    c = 0.05 * 0.4 / (20.0 * 0.2 * math.pi / counts)
    assert 1.0 - (1.0 - c) ** 2 == pytest.approx(0.95, rel=1e-4)  # the rounding under way adds little


def test_turns_end_by_their_heading():
    """(d / L) sqrt(1/3), as normal."""
    counts = module.closed_form_counts(rolled(('turns', 5.0)).requested, ALTO, Requirement(yaw_rad=0.01))
    assert counts == pytest.approx(NORMAL_80 * 0.2 * math.pi / 0.4 / math.sqrt(3.0) / 0.01, rel=1e-3)
    assert module.local_counts(ALTO, Requirement(yaw_rad=0.01)) == pytest.approx(counts)


def test_fractions_that_fall_are_pooled():
    ranks = [(5, 10), (3, 10), (27, 30), (8, 10), (10, 10)]
    assert module.monotone_fractions(ranks) == [0.4, 0.4, 0.875, 0.875, 1.0]
    assert module.monotone_fractions(ranks[::-1]) == [pytest.approx(53 / 70)] * 5
    assert module.monotone_fractions([]) == []


def answer_of(encoder=None, required=Requirement(), **errors):
    params = encoder_of(90, encoder)
    return odometry_answer(OdometryCurves([DriveDraws(fast(LENGTH_M), robot_of(**errors), 1)], params), required)


def test_the_encoder_is_not_the_limit():
    """A wheel that is 0.1 % larger is 125 mm off after 10 m; at half of the tolerance an encoder is found."""
    answer = answer_of(left_radius_error=0.001)
    (limit,) = answer.limits
    assert (answer.kind, limit.cause) == (Kind.NOT_THE_LIMIT, RADIUS)
    assert limit.error == pytest.approx(LENGTH_M**2 * 0.001 / (2.0 * SEPARATION_M), rel=0.01)
    assert limit.reduced_to == pytest.approx(MOST_BY_ONE_CAUSE * Requirement().position_m)
    half = answer_of(left_radius_error=0.001 * limit.reduced_to / limit.error)
    assert answer.counts == pytest.approx(half.counts, rel=0.15)


def test_a_loose_calibration_is_the_limit_and_a_tight_one_is_not():
    """Radii that are known to 0.5 % move a robot of 0.56 m by 1.9 m after 20 m, which no encoder corrects."""
    drive = rolled(('straight', 20.0), separation_m=0.56, speed=10.0, acceleration=20.0)

    def answer_with(ratio):
        robot = robot_of(separation_m=0.56, calibration=calibrated(ratio=ratio))
        return odometry_answer(OdometryCurves([DriveDraws(drive, robot, 1)], encoder_of(90)), Requirement())

    loose = answer_with(0.0053 / NORMAL_80)
    (limit,) = loose.limits
    assert (loose.kind, limit.cause, limit.axis) == (Kind.NOT_THE_LIMIT, CALIBRATED_GEOMETRY[1], 'across')
    assert limit.error == pytest.approx(1.9, rel=0.1)
    counts = 347.3 * 0.4 / 0.56  # in closed form, of quantisation
    assert answer_with(1e-5).counts == pytest.approx(counts, rel=0.1) and loose.counts > counts


def test_at_the_edge_it_is_undecided():
    """Where 80 % of the robots have radii that are near enough, an encoder of endless resolution is 80 % right."""
    spread = Requirement().position_m * 2.0 * SEPARATION_M / (math.sqrt(2.0) * LENGTH_M**2 * NORMAL_80)
    answer = answer_of(radius_spread=spread, required=Requirement()._replace(yaw_rad=1.0))
    assert answer.kind is Kind.UNDECIDED and 'success rate near 0.8' in answer.note


def test_with_much_slip_the_encoders_own_errors_may_still_be_what_is_too_much():
    """Slip takes 42 of 50 mm, with an ideal encoder for certain; an error of its own below half makes it too much."""
    shift = {'left_slip': 42e-3 * 2.0 * SEPARATION_M / LENGTH_M**2}
    own = {'eccentricity': 0.4 * 0.05 * SEPARATION_M / (NORMAL_80 * LENGTH_M * RADIUS_M)}
    answer = answer_of(own, Requirement()._replace(yaw_rad=1.0), **shift)
    assert answer.kind is Kind.NOT_THE_LIMIT and answer.of_encoder
    assert [limit.cause for limit in answer.limits] == [SLIP, EDGES]
    assert str(answer).startswith("the encoder's counts are not the limit: ")
    assert answer.counts is not None


def budget_of(encoder=None, **errors):
    draws = DriveDraws(line(LINE_M, speed=2.0, acceleration=2.0), robot_of(**errors), 1)
    return module.odometry_budgets(draws, [encoder_of(PPR, encoder)])[0]


def across_variance_m2(pulses2):
    return (LINE_M * m_per_pulse(PPR) / SEPARATION_M) ** 2 * pulses2


@pytest.mark.parametrize(
    ('cause', 'encoder', 'errors', 'variance_m2'),
    [
        (QUANTISATION, {}, {}, across_variance_m2(1 / 6)),
        (EDGES, {'edge_error': 0.3}, {}, across_variance_m2(2 * 0.3**2)),
        (MISSED, {'faults': {'missed': 0.01}}, {}, NOISE_M3 * m_per_pulse(PPR) * 0.01 * 0.99),
        (SLIP, {}, {'slip_noise': 1e-6}, NOISE_M3 * 1e-6),
        (RADIUS, {}, {'radius_spread': 1e-4}, 2 * (LINE_M**2 * 1e-4 / (2 * SEPARATION_M)) ** 2),
    ],
    ids=['quantisation', 'edges', 'missed', 'slip', 'radius'],
)
def test_a_cause_by_itself_is_its_closed_form(cause, encoder, errors, variance_m2):
    part = budget_of(encoder, **errors).parts[cause]
    assert part.variance[ACROSS] == pytest.approx(variance_m2, rel=0.25)  # edges: 8 % (one sd over seeds)


def test_causes_add_up_to_what_is_found():
    errors = {'slip_noise': 1e-7, 'radius_spread': 5e-5, 'left_radius_error': 1e-4, 'wheel_separation_spread': 0.001}
    budget = budget_of({'edge_error': 0.2, 'faults': {'missed': 0.001}}, **errors)
    assert len(budget.parts) == 7
    assert np.all(np.abs(budget.rest.variance) < 0.15 * budget.found.variance + 1e-12)
    assert np.all(np.abs(budget.rest.bias) < 0.1 * budget.found.std + 1e-6)
