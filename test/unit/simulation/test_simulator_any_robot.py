"""The simulator with robots that are not ALTO."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import DiffEncoder, EncoderParams
from generated_robots import LASER, LEFT, RECIPES, RIGHT, Recipe, urdf_of

START = Pose2D(-3.4, -0.85, 0.4)
NAMES = {'left_joint': LEFT, 'right_joint': RIGHT, 'laser_link': LASER}


@pytest.fixture
def make(make_simulator, tmp_path):
    def make_it(recipe, start=START, world='ros_logo', **params):
        path = tmp_path / 'robot.urdf'
        path.write_text(urdf_of(recipe, tmp_path))
        return make_simulator(world, start, robot=path, **NAMES, **params)

    return make_it


def drive_by_odometry(simulator, odometry, encoder, phases):
    """Drive (linear, angular, seconds) in turn; returns odometry's last estimate, in the start pose's frame."""
    estimate = odometry.update(*encoder.update(*simulator.joint_states()[:3]))
    for linear, angular, seconds in phases:
        for _ in range(round(100 * seconds)):
            simulator.command(linear, angular)
            simulator.tick()
            sample = encoder.update(*simulator.joint_states()[:3])
            estimate = estimate if sample is None else odometry.update(*sample)
    return estimate


@pytest.mark.parametrize('name', ['mirrored axes, tyre and hub', 'laser aside, axle ahead of the root'])
def test_odometry_of_joint_states_is_where_the_robot_is(make, name):
    """Axes that point to the right, and a base_link behind the axle."""
    recipe = RECIPES[name]
    simulator = make(recipe, lidar={'noise': 0.0})
    encoder = DiffEncoder(
        EncoderParams(ppr=1e6, left_joint=LEFT, right_joint=RIGHT, right_reversed=recipe.has_mirrored_axes)
    )
    odometry = WheelOdometry(
        OdometryParams(
            ppr=1e6, wheel_diameter=2 * recipe.radius_m, wheel_separation=recipe.separation_m, axle_x=recipe.axle_x_m
        )
    )
    estimate = drive_by_odometry(
        simulator, odometry, encoder, [(0.0, 1.0, 4.0), (0.3, -0.4, 3.0), (-0.2, 0.7, 2.0), (0.0, 0.0, 1.0)]
    )
    truth = simulator.base_pose_in_world().relative_to(START)
    assert math.hypot(*truth[:2]) > 0.2
    # A step of 10 ms moves the robot along the heading at its end: up to v 5 ms for each change of velocity.
    assert tuple(estimate.base_pose_in_odom) == pytest.approx(tuple(truth), abs=4e-3)
    assert simulator.obstacle_hit() is None


def test_the_true_velocity_of_a_base_behind_the_axle_is_the_odometrys(make):
    simulator = make(RECIPES['laser aside, axle ahead of the root'])
    for _ in range(200):
        simulator.command(0.2, 0.8)
        simulator.tick()
    base, yaw = simulator.base(), simulator.base_pose_in_world().yaw_rad
    x_mps, y_mps, _ = base.linear_xyz_mps
    assert math.cos(yaw) * x_mps + math.sin(yaw) * y_mps == pytest.approx(0.2, abs=2e-3)
    assert math.cos(yaw) * y_mps - math.sin(yaw) * x_mps == pytest.approx(-0.15 * 0.8, abs=2e-3)


@pytest.mark.parametrize('root_height_m', [0.0, 0.033, 0.2])
def test_the_root_is_as_high_above_the_floor_as_in_the_file(make, root_height_m):
    simulator = make(Recipe(root_height_m=root_height_m))
    assert simulator.base().position_xyz_m[2] == pytest.approx(root_height_m, abs=1e-4)


@pytest.mark.parametrize(('y_m', 'is_hit'), [(0.0, True), (0.18, False)])
def test_the_hull_hits_walls_and_the_balls_of_the_wheels_do_not(make, y_m, is_hit, tmp_path):
    """The ball of a wheel of 0.2 m ends 0.1 m farther out than the wheel."""
    recipe = Recipe(
        20.0, (-0.05, 0.0, 0.1), (0.4, 0.2, 0.2), radius_m=0.1, separation_m=0.22, wheel_mass_kg=0.5,
        casters_m=((-0.15, 0.0),), laser_m=(0.0, 0.0, 0.3),
    )  # fmt: skip
    world = tmp_path / 'wall.world'
    models = {'floor': '<plane/>', 'wall': '<box><size>0.6 0.02 0.4</size></box>'}
    world.write_text(
        '<sdf version="1.6"><world name="wall">'
        + ''.join(
            f'''<model name="{name}"><static>1</static><pose>{place} 0 0 0</pose><link name="l">
            <collision name="c"><geometry>{models[name]}</geometry></collision></link></model>'''
            for name, place in (('floor', '0 0 0'), ('wall', f'0.5 {y_m} 0.2'))
        )
        + '</world></sdf>'
    )
    simulator = make(recipe, Pose2D(0.0, 0.0, 0.0), world)
    for _ in range(100):
        simulator.command(0.3, 0.0)
        simulator.tick()
    assert (simulator.obstacle_hit() is not None) == is_hit


def test_nothing_of_pybullet_reaches_the_terminal(make, capfd):
    make(RECIPES['frames without inertia']).tick()
    assert capfd.readouterr() == ('', '')
    assert np.isfinite(make(RECIPES['frames without inertia']).base().position_xyz_m).all()
