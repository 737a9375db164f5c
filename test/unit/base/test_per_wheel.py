"""Numbers of both wheels."""

import json

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.wheels.odometry_params import OdometryParams

BOTH = {'left': 0.316, 'right': 0.318}


@pytest.mark.parametrize(('given', 'radii_m', 'text'), [
    (0.2, (0.1, 0.1), '0.2'),
    ({'left': 0.2, 'right': 0.2}, (0.1, 0.1), '0.2'),
    (BOTH, (0.158, 0.159), '0.316 (left) and 0.318 (right)'),
])  # fmt: skip
def test_a_diameter_is_of_both_wheels_or_of_each_and_is_written_so(given, radii_m, text):
    params = OdometryParams.from_mapping({'wheel_diameter': given}, '')
    diameter, written = params.wheel_diameter, params.model_dump(mode='json')['wheel_diameter']
    assert (diameter.radii_m, str(diameter), diameter.mean) == (radii_m, text, pytest.approx(sum(radii_m)))
    assert json.dumps(written) == json.dumps(given if given == BOTH else 0.2) == json.dumps(diameter.plain)
    assert OdometryParams.from_mapping({'wheel_diameter': written}, '') == params
    assert params.m_per_pulse[0] / params.m_per_pulse[1] == pytest.approx(radii_m[0] / radii_m[1])


@pytest.mark.parametrize(('given', 'error'), [
    (0.0, 'c.yaml: wheel_diameter: given 0.0; allowed: 0.001 to 100 [m], or {left: ..., right: ...}'),
    ({'left': 0.2}, 'c.yaml: wheel_diameter.right: missing'),
    ({'left': 0.2, 'right': -1.0}, 'c.yaml: wheel_diameter.right: given -1.0; allowed: 0.001 to 100 [m]'),
    ({'left': 0.2, 'rigth': 0.2}, "c.yaml: wheel_diameter.rigth: unknown key; did you mean 'right'?"),
])  # fmt: skip
def test_a_bad_diameter_is_named(given, error):
    with pytest.raises(ConfigError) as refused:
        OdometryParams.from_mapping({'wheel_diameter': given}, 'c.yaml')
    assert str(refused.value) == error


def test_the_simulators_may_be_as_in_the_robots_file():
    assert SimulatorParams().choices().wheel_diameter.plain == 0.0
    params = SimulatorParams.from_mapping({'wheel_diameter': BOTH}, '')
    assert params.choices().wheel_diameter.plain == params.model_dump(mode='json')['wheel_diameter'] == BOTH
