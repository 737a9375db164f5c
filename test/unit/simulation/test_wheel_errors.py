"""Wheel errors and slip: as large as asked for."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.simulation.simulator import WheelErrorParams
from places import ROOT
from simulated_drive import RADIUS_M, SEPARATION_M, drive


def test_a_radius_error_makes_both_wheels_disagree_with_the_odometry(make_simulator):
    simulator = make_simulator(wheel_errors={'left_radius_error': -0.01, 'right_radius_error': -0.01})
    wheels, _ = drive(simulator, 0.45, 0.0, 10.0)
    driven_m = simulator.base_pose_in_world().x_m + 10
    assert driven_m / (RADIUS_M * wheels.mean()) == pytest.approx(0.99, abs=2e-4)


def test_a_separation_error_makes_turns_disagree_with_the_odometry(make_simulator):
    simulator = make_simulator('ros_logo', Pose2D(-3.4, -0.85, 0), wheel_errors={'wheel_separation_error': 0.02})
    wheels, turned = drive(simulator, 0.0, 1.0, 2 * math.pi)
    measured = RADIUS_M * (wheels[1] - wheels[0]) / SEPARATION_M
    assert turned / measured == pytest.approx(1 / 1.02, abs=2e-4)


def test_slip_turns_the_wheel_farther_than_the_robot_goes(make_simulator):
    simulator = make_simulator(wheel_errors={'left_slip': 0.05, 'right_slip': 0.05})
    wheels, _ = drive(simulator, 0.45, 0.0, 10.0)
    driven_m = simulator.base_pose_in_world().x_m + 10
    assert driven_m / (RADIUS_M * wheels.mean()) == pytest.approx(0.95, abs=2e-4)
    assert RADIUS_M * wheels.mean() == pytest.approx(0.45 * 10, rel=0.05)  # wheels obey commands


@pytest.mark.heavy
def test_slip_noise_has_the_variance_that_was_asked_for(make_simulator):
    noise, errors_m = 1e-4, []
    for seed in range(40):
        simulator = make_simulator(seed=seed, wheel_errors={'slip_noise': noise})
        wheels, _ = drive(simulator, 0.45, 0.0, 2.0)
        errors_m += (RADIUS_M * wheels - (simulator.base_pose_in_world().x_m + 10)).tolist()
        simulator.close()
    path_m = 0.9 - 0.45 * 0.3  # the ramp takes 0.6 s, on average at half the speed
    # 80 samples: their variance is within 1 +- 0.45 of the true one in 99 % of cases.
    assert np.var(errors_m) == pytest.approx(noise * path_m, rel=0.45)


def test_a_robot_file_without_arguments_for_errors_has_them_all_the_same(make_simulator, tmp_path):
    plain = tmp_path / 'plain.urdf.xacro'
    text = (ROOT / 'urdf' / 'alto.urdf.xacro').read_text()
    for argument in ('wheel_radius_error_left', 'wheel_radius_error_right', 'wheel_separation_error'):
        text = text.replace(f'$(arg {argument})', '0').replace(f'<xacro:arg name="{argument}" default="0"/>', '')
    plain.write_text(text)
    errors = {'left_radius_error': 0.01, 'right_radius_error': 0.01, 'wheel_separation_error': -0.03}
    simulator = make_simulator('ros_logo', Pose2D(-3.4, -0.85, 0), robot=plain, wheel_errors=errors)
    wheels, turned = drive(simulator, 0.0, 1.0, 2 * math.pi)
    measured = RADIUS_M * (wheels[1] - wheels[0]) / SEPARATION_M
    assert turned / measured == pytest.approx(1.01 / 0.97, abs=2e-4)


def test_robots_differ_from_each_other_by_the_spread_that_was_asked_for():
    params = WheelErrorParams(left_radius_error=0.01, radius_spread=0.002, wheel_separation_spread=0.004)
    drawn = np.array([params.geometry(np.random.default_rng(seed)) for seed in range(2000)])
    np.testing.assert_allclose(drawn.mean(axis=0), [0.01, 0.0, 0.0], atol=3e-4)
    np.testing.assert_allclose(drawn.std(axis=0), [0.00202, 0.002, 0.004], rtol=0.06)


def test_the_same_seed_makes_the_same_robot(make_simulator):
    turned = []
    for seed in (1, 1, 2):
        simulator = make_simulator(seed=seed, wheel_errors={'radius_spread': 0.01})
        drive(simulator, 0.45, 0.0, 2.0)
        turned.append(simulator.base_pose_in_world())
        simulator.close()
    assert turned[0] == turned[1] != turned[2]
