"""The stand-in for Gazebo: repeatable, resettable, and strict about its parameters."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.simulation.state import PlanarVelocity
from places import ROOT
from simulated_drive import RADIUS_M, drive


def test_the_same_seed_gives_the_same_numbers_bit_for_bit_and_after_a_reset(make_simulator):
    runs = []
    simulator = make_simulator(seed=5, wheel_errors={'slip_noise': 1e-5})
    for _ in range(2):
        drive(simulator, 0.4, 0.2, 1.0)
        runs.append((simulator.joint_states(), simulator.base(), simulator.time_ns))
        simulator.reset()
    other = make_simulator(seed=5, wheel_errors={'slip_noise': 1e-5})
    drive(other, 0.4, 0.2, 1.0)
    runs.append((other.joint_states(), other.base(), other.time_ns))
    assert runs[0] == runs[1] == runs[2]


def test_the_wheel_phase_is_drawn_from_the_seed(make_simulator):
    phases = np.array([make_simulator(seed=seed).joint_states().angles_rad for seed in range(8)])
    assert ((0 <= phases) & (phases < 2 * math.pi)).all()
    assert len(np.unique(phases)) == 16
    assert make_simulator(seed=3).joint_states().angles_rad == tuple(phases[3])


def test_reset_world_carries_the_robot_back_and_leaves_time_and_wheels(make_simulator):
    simulator = make_simulator()
    drive(simulator, 0.45, 0.3, 2.0)
    time_ns, angles = simulator.time_ns, simulator.joint_states().angles_rad
    simulator.reset_world()
    assert tuple(simulator.base_pose_in_world()) == pytest.approx((-10, 0, 0), abs=1e-6)
    assert (simulator.time_ns, simulator.joint_states().angles_rad) == (time_ns, angles)


def test_a_kidnapped_robot_is_elsewhere_and_its_wheels_know_nothing(make_simulator):
    simulator = make_simulator()
    drive(simulator, 0.45, 0.3, 2.0)
    time_ns, joints = simulator.time_ns, simulator.joint_states()
    scan_before = simulator.scan().ranges_m
    simulator.place(Pose2D(5.0, 1.0, -2.0))
    assert tuple(simulator.base_pose_in_world()) == pytest.approx((5.0, 1.0, -2.0), abs=1e-6)
    assert simulator.base().linear_xyz_mps == pytest.approx((0, 0, 0), abs=1e-12)
    assert (simulator.time_ns, simulator.joint_states()) == (time_ns, joints)
    assert not np.allclose(simulator.scan().ranges_m, scan_before, atol=0.5)
    simulator.tick()
    assert simulator.time_ns == time_ns + 10_000_000
    assert simulator.joint_states().angles_rad == pytest.approx(joints.angles_rad, abs=1e-3)


def test_a_robot_that_is_placed_while_driving_drives_on(make_simulator):
    simulator = make_simulator()
    for _ in range(100):
        simulator.command(0.45, 0.0)
        simulator.tick()
    turned = simulator.joint_states().angles_rad
    simulator.place(Pose2D(0.0, 0.0, math.pi / 2), PlanarVelocity(0.0, 0.45, 0.0))
    for _ in range(100):
        simulator.command(0.45, 0.0)
        simulator.tick()
    end = simulator.base_pose_in_world()
    assert tuple(end) == pytest.approx((0.0, 0.45, math.pi / 2), abs=0.005)
    wheel_m = RADIUS_M * (np.array(simulator.joint_states().angles_rad) - turned)
    assert wheel_m == pytest.approx(end.y_m, abs=0.002)


def test_it_starts_at_rest_exactly_where_it_was_put(make_simulator):
    simulator = make_simulator('ros_logo', Pose2D(-3.4, -0.85, 2.0))
    assert tuple(simulator.base_pose_in_world()) == pytest.approx((-3.4, -0.85, 2.0), abs=1e-6)
    for _ in range(100):
        simulator.tick()
    assert tuple(simulator.base_pose_in_world()) == pytest.approx((-3.4, -0.85, 2.0), abs=1e-4)
    assert abs(simulator.base().position_xyz_m[2]) < 1e-3


@pytest.mark.parametrize(
    ('params', 'complaint'),
    [
        ({'drive': {'wheel_torque': 0}}, 'drive.wheel_torque: given 0'),
        ({'physics': {'steps_per_tick': 1.5}}, 'physics.steps_per_tick'),
        ({'wheel_errors': {'left_slip': 1.0}}, 'wheel_errors.left_slip: given 1.0'),
        ({'wheel_errors': {'slip': 0.1}}, 'wheel_errors.slip: unknown key'),
        ({'lidar': {'rate': 30.0}}, "lidar: given {'rate': 30.0}; allowed: a rate whose period is whole 10 ms"),
    ],
)
def test_bad_parameters_are_named(params, complaint):
    with pytest.raises(ConfigError, match=complaint):
        SimulatorParams.from_mapping(params, 'simulator.yaml')


def test_the_shipped_configuration_states_the_defaults():
    assert load_params(SimulatorParams, ROOT / 'config' / 'simulator.yaml') == SimulatorParams()
