"""The closed form of quantisation, and its table."""

import math

import numpy as np
import pytest

from diff_encoder_sim.analysis.closed_form import closed_form_std, closed_form_table, heading_std_rad, wheel_travel_m
from diff_encoder_sim.drives.test_definition import PoseParams
from trial_tables import ALTO, IN, cell, navigated, results_of, trial


@pytest.mark.parametrize('travel_m', [20.0, -3.3])
def test_the_heading_is_that_of_counted_pulses(travel_m):
    """Wheels with uniform phases travel equally far; the encoder counts whole pulses (equation 1)."""
    m_per_pulse, phases = math.pi * 0.2 / 90, np.random.default_rng(2).uniform(0.0, 1.0, (2, 20000))
    left, right = np.floor(phases + travel_m / m_per_pulse) - np.floor(phases)
    expected_rad = float(np.std((right - left) * m_per_pulse / 0.4))
    assert heading_std_rad(np.array([travel_m]), m_per_pulse, 0.4) == pytest.approx(expected_rad, rel=0.02)


def test_the_heading_averages_over_stops_and_vanishes_after_whole_pulses():
    m_per_pulse = math.pi * 0.2 / 40
    stops_m = 20.0 + m_per_pulse * np.linspace(0.0, 3.0, 3000, endpoint=False)
    assert heading_std_rad(stops_m, m_per_pulse, 0.4) == pytest.approx(m_per_pulse / 0.4 * math.sqrt(1.0 / 3.0))
    for ppr in (40, 4096):
        assert heading_std_rad(np.array([5.0 * math.pi * 0.4]), math.pi * 0.2 / ppr, 0.4) == 0.0


@pytest.mark.parametrize('nav', ['embedded', 'scripted'])
def test_wheels_travel_as_far_as_the_robot_truly_went(nav):
    straight, turning = (navigated(test).model_copy(update={'nav': nav}) for test in ('SL', 'SMT'))
    assert wheel_travel_m(straight, ALTO, np.array([[-0.04, 0.3, 0.1]])) == pytest.approx([19.96])
    assert wheel_travel_m(turning, ALTO, np.array([[0.1, 0.0, -0.1]])) == pytest.approx([0.2 * (10.0 * math.pi - 0.1)])


@pytest.mark.parametrize(('ppr', 'lateral_m'), [(40, 0.321), (4096, 0.0031)])
def test_closed_form_of_the_straight_line(ppr, lateral_m):
    _, y_m, yaw_rad = closed_form_std(navigated('SL'), ALTO, ppr)
    assert y_m == pytest.approx(lateral_m, rel=0.015)
    assert yaw_rad == pytest.approx(math.pi * 0.2 / ppr / 0.4 * math.sqrt(1.0 / 3.0))


def test_closed_form_is_along_the_maps_axes():
    requested = navigated('SL')
    goal = requested.test.route[-1].model_copy(update={'goal': PoseParams(y=20.0, yaw=math.pi / 2)})
    test = requested.test.model_copy(update={'start': PoseParams(yaw=math.pi / 2), 'route': [goal]})
    turned = requested.model_copy(update={'test': test})
    along_x, along_y = closed_form_std(requested, ALTO, 40), closed_form_std(turned, ALTO, 40)
    assert along_y == pytest.approx(along_x[[1, 0, 2]])


STRAIGHT = {'SL': navigated('SL')}
HERE = (0.0, 0.0, 0.0)


def entries(*trials, requested=STRAIGHT):
    """The entries of the table by quantity, without the cell."""
    table = closed_form_table(results_of(trials, requested=requested))
    return {row[1]: row[2:] for row in table.exact.values.tolist()}


def test_the_closed_form_is_that_of_a_straight_drive():
    errors = [(0.0, 0.3, 1.0), (0.0, -0.3, -1.0)]
    found = entries(*(trial('SL', '40', place, odom=errors[place], world=HERE) for place in (0, 1)))
    # (S d / L) sqrt(1/6) = 321 mm; 0.3 m sqrt(2) = 424 mm.
    assert found['y [mm]'][0] == '321' and found['y [mm]'][1].startswith('424 (')
    # 20 m are 1273.24 pulses: 2.25 degrees sqrt(2 0.24 0.76), and all trials stopped just there.
    assert (found['yaw [deg]'][0], found['yaw [deg]'][2], found['x [mm]'][2]) == ('1.36', 'as expected', 'below')
    assert closed_form_table(results_of(cell('SL', '40', 'odom', [IN]), requested=STRAIGHT)) is None


def test_the_heading_is_that_of_where_the_trials_stopped():
    stops = [(-1.0, 0.0, 0.0), (-0.5, 0.0, 0.0)]  # 19 m are 1209.58 pulses, 19.5 m are 1241.41
    found = entries(*(trial('SL', '40', number, odom=stop, world=stop) for number, stop in enumerate(stops)))
    expected_deg = 2.25 * math.sqrt(0.5775 * 0.4225 + 0.4084 * 0.5916)  # 2 f (1 - f), and the mean of both
    assert float(found['yaw [deg]'][0]) == pytest.approx(expected_deg, abs=0.005)


def test_other_drives_only_have_the_average():
    trials = [trial('DLD', '40', number, odom=IN, world=HERE) for number in (1, 2)]
    assert entries(*trials, requested={'DLD': navigated('DLD')})['yaw [deg]'][0] == '1.3'
