"""The stand-in for Gazebo: repeatable and resettable, its drive, errors of wheels, other robots, and the scanner."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expansion
from diff_encoder_sim.simulation.simulator import DriveController, DriveParams, SimulatorParams
from diff_encoder_sim.simulation.state import PlanarVelocity
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from generated_robots import LASER, LEFT, RECIPES, RIGHT, Recipe, urdf_of
from places import ROOT
from simulated_drive import RADIUS_M, SEPARATION_M, box_world, drive

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
SECOND = 1_000_000_000
START = Pose2D(-3.4, -0.85, 0.4)
NAMES = {'left_joint': LEFT, 'right_joint': RIGHT, 'laser_link': LASER}


def test_the_same_seed_gives_the_same_numbers_bit_for_bit_and_after_a_reset(make_simulator):
    errors = {'slip_noise': 1e-5, 'radius_spread': 0.01}

    def state(simulator):
        drive(simulator, 0.4, 0.2, 1.0)
        return simulator.joint_states(), simulator.physics.base(), simulator.time_ns

    simulator = make_simulator(seed=5, wheel_errors=errors)
    first = state(simulator)
    simulator.reset()
    assert first == state(simulator) == state(make_simulator(seed=5, wheel_errors=errors))
    assert first[1] != state(make_simulator(seed=6, wheel_errors=errors))[1]  # another robot
    phases = np.array([make_simulator(seed=seed).joint_states().angles_rad for seed in range(4)])
    assert ((0 <= phases) & (phases < 2 * math.pi)).all() and len(np.unique(phases)) == 8


def test_a_robot_put_elsewhere_keeps_time_and_wheel_angles(make_simulator):
    simulator = make_simulator()
    drive(simulator, 0.45, 0.3, 2.0)
    time_ns, joints, scan = simulator.time_ns, simulator.joint_states(), simulator.scan().ranges_m
    simulator.physics.place(Pose2D(5.0, 1.0, -2.0))
    assert tuple(simulator.physics.base_pose_in_plane()) == pytest.approx((5.0, 1.0, -2.0), abs=1e-6)
    assert simulator.physics.base().linear_xyz_mps == pytest.approx((0, 0, 0), abs=1e-12)
    assert (simulator.time_ns, simulator.joint_states()) == (time_ns, joints)
    assert not np.allclose(simulator.scan().ranges_m, scan, atol=0.5)
    simulator.tick()
    assert simulator.time_ns == time_ns + 10_000_000
    simulator.reset_world()
    assert tuple(simulator.physics.base_pose_in_plane()) == pytest.approx((-10, 0, 0), abs=1e-6)
    assert simulator.joint_states().angles_rad == pytest.approx(joints.angles_rad, abs=1e-3)
    for _ in range(100):  # it rests there
        simulator.tick()
    assert tuple(simulator.physics.base_pose_in_plane()) == pytest.approx((-10, 0, 0), abs=2e-4)
    assert abs(simulator.physics.base().position_xyz_m[2]) < 1e-3


def test_a_robot_that_is_placed_while_driving_drives_on(make_simulator):
    simulator = make_simulator()
    for _ in range(100):
        simulator.command(0.45, 0.0)
        simulator.tick()
    turned = simulator.joint_states().angles_rad
    simulator.physics.place(Pose2D(0.0, 0.0, math.pi / 2), PlanarVelocity(0.0, 0.45, 0.0))
    for _ in range(100):
        simulator.command(0.45, 0.0)
        simulator.tick()
    end = simulator.physics.base_pose_in_plane()
    assert tuple(end) == pytest.approx((0.0, 0.45, math.pi / 2), abs=0.005)
    wheel_m = RADIUS_M * (np.array(simulator.joint_states().angles_rad) - turned)
    assert wheel_m == pytest.approx(end.y_m, abs=0.002)


def test_a_scanner_has_a_period_of_whole_ticks_and_the_file_of_config_the_defaults():
    with pytest.raises(ConfigError, match="lidar: given {'rate': 30.0}; allowed: a rate whose period is whole 10 ms"):
        SimulatorParams.from_mapping({'lidar': {'rate': 30.0}}, 'simulator.yaml')
    assert load_params(SimulatorParams, ROOT / 'config' / 'simulator.yaml') == SimulatorParams()


def controller(**params):
    return DriveController(DriveParams(**params), radii_m=(0.1, 0.1), wheel_separation_m=0.4)


def settled(drive, linear, angular):
    for tick in range(200):
        now = tick * SECOND // 100
        drive.command(now, linear, angular)
        speeds = drive.wheel_speeds_radps(now, 0.01)
    return speeds


@pytest.mark.parametrize(
    ('linear', 'angular', 'speeds'),
    [(0.45, 0.0, (4.5, 4.5)), (-0.45, 0.0, (-4.5, -4.5)), (0.0, 1.0, (-2.0, 2.0)), (0.3, -0.5, (4.0, 2.0))],
)
def test_commands_become_wheel_speeds(linear, angular, speeds):
    assert settled(controller(), linear, angular) == pytest.approx(speeds)


def test_a_controller_that_knows_unequal_wheels_turns_each_at_its_own_speed():
    known = DriveController(DriveParams(), radii_m=(0.1, 0.125), wheel_separation_m=0.4)
    assert settled(known, 0.3, -0.5) == pytest.approx((4.0, 1.6))


@pytest.mark.parametrize('is_known', [True, False])
def test_known_unequal_wheels_drive_straight_and_unknown_ones_an_arc(make_simulator, is_known):
    """Of curvature (right - left radius) / (separation x mean radius); odometry of the true wheels is right."""
    true_m = {'left': 2 * RADIUS_M, 'right': 1.01 * 2 * RADIUS_M}
    params = {'wheel_diameter': true_m} if is_known else {'wheel_errors': {'right_radius_error': 0.01}}
    simulator = make_simulator(**params)
    start = simulator.physics.base_pose_in_plane()
    wheels, turned_rad = drive(simulator, 0.45, 0.0, 5.0)
    truth = simulator.physics.base_pose_in_plane().relative_to(start)
    odometry = WheelOdometry(OdometryParams(ppr=1e6, wheel_diameter=true_m, wheel_separation=SEPARATION_M))
    odometry.update(0, 0, 0)
    counts = np.rint(1e6 / (2 * math.pi) * wheels).astype(int).tolist()
    assert odometry.update(5 * SECOND, *counts).base_pose_in_odom == pytest.approx(truth, abs=1e-3)
    curvature = 0.0 if is_known else 0.01 / 1.005 / SEPARATION_M
    assert turned_rad == pytest.approx(truth.x_m * curvature, abs=2e-4)
    assert simulator.physics.base().quat_xyzw[:2] == pytest.approx((0.0, 0.0), abs=1e-4)  # level


def test_commands_are_ramped_and_cut_to_the_limits_with_a_warning(caplog):
    drive = controller(max_linear_acceleration=0.5)
    drive.command(0, 1.0, 0.0)
    speeds = [drive.wheel_speeds_radps(0, 0.01)[0] * 0.1 for _ in range(3)]
    assert speeds == pytest.approx([0.005, 0.010, 0.015]) and not caplog.text
    assert settled(controller(max_linear_speed=0.5), 99.0, 0.0) == pytest.approx((5.0, 5.0))
    assert 'exceeds the limits' in caplog.text


def test_the_last_finite_command_holds_until_it_times_out():
    drive = controller(command_timeout=0.5)
    settled(drive, 0.4, 0.5)
    last = 199 * SECOND // 100
    with pytest.raises(InputFault, match='finite'):
        drive.command(last + SECOND // 4, 0.0, math.inf)
    assert drive.wheel_speeds_radps(last + SECOND // 2, 0.01) == pytest.approx((3.0, 5.0))
    for tick in range(51, 200):
        speeds = drive.wheel_speeds_radps(last + tick * SECOND // 100, 0.01)
    assert speeds == (0.0, 0.0)


@pytest.mark.parametrize(
    ('errors', 'ratio'),
    [
        ({'left_radius_error': -0.01, 'right_radius_error': -0.01}, 0.99),
        ({'left_slip': 0.05, 'right_slip': 0.05}, 0.95),  # the wheels turn farther than the robot goes
    ],
)
def test_straight_ahead_truth_and_wheels_differ_by_radius_and_slip(make_simulator, errors, ratio):
    simulator = make_simulator(wheel_errors=errors)
    wheels, _ = drive(simulator, 0.45, 0.0, 10.0)
    driven_m = simulator.physics.base_pose_in_plane().x_m + 10
    assert driven_m / (RADIUS_M * wheels.mean()) == pytest.approx(ratio, abs=2e-4)
    assert RADIUS_M * wheels.mean() == pytest.approx(0.45 * 10, rel=0.05)  # wheels obey commands


@pytest.mark.parametrize('has_arguments', [True, False])
def test_in_turns_they_differ_by_radius_and_separation_whatever_the_robot_file(make_simulator, tmp_path, has_arguments):
    path, text = tmp_path / 'robot.urdf.xacro', ALTO.read_text()
    for argument in ('wheel_radius_error_left', 'wheel_radius_error_right', 'wheel_separation_error'):
        if not has_arguments:
            text = text.replace(f'$(arg {argument})', '0').replace(f'<xacro:arg name="{argument}" default="0"/>', '')
    path.write_text(text)
    errors = {'left_radius_error': 0.01, 'right_radius_error': 0.01, 'wheel_separation_error': -0.03}
    simulator = make_simulator('ros_logo', Pose2D(-3.4, -0.85, 0), robot=path, wheel_errors=errors)
    wheels, turned = drive(simulator, 0.0, 1.0, 2 * math.pi)
    measured = RADIUS_M * (wheels[1] - wheels[0]) / SEPARATION_M
    assert turned / measured == pytest.approx(1.01 / 0.97, abs=2e-4)


@pytest.fixture
def make(make_simulator, tmp_path):
    def make_it(recipe, start=START, world='ros_logo', **params):
        path = tmp_path / 'robot.urdf'
        path.write_text(urdf_of(recipe, tmp_path))
        return make_simulator(world, start, robot=path, **NAMES, **params)

    return make_it


@pytest.mark.parametrize('name', ['mirrored axes, tyre and hub', 'laser aside, axle ahead of the root'])
def test_odometry_of_joint_states_is_where_the_robot_is(make, name):
    """Axes that point to the right, and a base_link behind the axle; its velocity, too."""
    recipe = RECIPES[name]
    simulator = make(recipe)
    reversed_axes = {'right_reversed': recipe.has_mirrored_axes}
    encoder = ReportingEncoder(EncoderParams(ppr=1e6, left_joint=LEFT, right_joint=RIGHT, **reversed_axes))
    geometry = {'wheel_diameter': 2 * recipe.radius_m, 'wheel_separation': recipe.separation_m}
    odometry = WheelOdometry(OdometryParams(ppr=1e6, axle_x=recipe.axle_x_m, **geometry))
    (sample,) = encoder.update(*simulator.joint_states()[:3])
    estimate = odometry.update(*sample)
    for linear, angular, seconds in [(0.0, 1.0, 4.0), (0.3, -0.4, 3.0), (-0.2, 0.7, 2.0), (0.0, 0.0, 1.0)]:
        for _ in range(round(100 * seconds)):
            simulator.command(linear, angular)
            simulator.tick()
            for sample in encoder.update(*simulator.joint_states()[:3]):
                estimate = odometry.update(*sample)
        (x_mps, y_mps, _), yaw_rad = (
            simulator.physics.base().linear_xyz_mps,
            simulator.physics.base_pose_in_plane().yaw_rad,
        )
        true_mps = (x_mps + 1j * y_mps) * np.exp(-1j * yaw_rad)
        assert true_mps == pytest.approx(estimate.linear_velocity_mps + 1j * estimate.lateral_velocity_mps, abs=2e-3)
    truth = simulator.physics.base_pose_in_plane().relative_to(START)
    assert math.hypot(*truth[:2]) > 0.2
    # A step of 10 ms moves the robot along the heading at its end: up to v 5 ms for each change of velocity.
    assert tuple(estimate.base_pose_in_odom) == pytest.approx(tuple(truth), abs=4e-3)
    assert simulator.physics.obstacle_hit() is None


@pytest.mark.parametrize('root_height_m', [0.0, 0.033, 0.2])
def test_the_root_is_as_high_above_the_floor_as_in_the_file(make, root_height_m):
    simulator = make(Recipe(root_height_m=root_height_m))
    assert simulator.physics.base().position_xyz_m[2] == pytest.approx(root_height_m, abs=1e-4)


@pytest.mark.parametrize(('y_m', 'is_hit'), [(0.0, True), (0.18, False)])
def test_the_hull_hits_walls_and_the_balls_of_the_wheels_do_not(make, y_m, is_hit, tmp_path):
    """The ball of a wheel of 0.2 m ends 0.1 m farther out than the wheel."""
    wheels = {'radius_m': 0.1, 'separation_m': 0.22, 'wheel_mass_kg': 0.5}
    places = {'casters_m': ((-0.15, 0.0),), 'laser_m': (0.0, 0.0, 0.3)}
    recipe = Recipe(20.0, (-0.05, 0.0, 0.1), (0.4, 0.2, 0.2), **wheels, **places)
    world = box_world(tmp_path / 'wall.world', (f'0.5 {y_m} 0.2', '0.6 0.02 0.4'))
    simulator = make(recipe, Pose2D(0.0, 0.0, 0.0), world)
    for _ in range(100):
        simulator.command(0.3, 0.0)
        simulator.tick()
    assert (simulator.physics.obstacle_hit() is not None) == is_hit


def test_nothing_of_pybullet_reaches_the_terminal(make, capfd):
    simulator = make(RECIPES['frames without inertia'])
    simulator.tick()
    assert capfd.readouterr() == ('', '') and np.isfinite(simulator.physics.base().position_xyz_m).all()


@pytest.fixture
def make_mounted(make_simulator, tmp_path):
    """ALTO with its laser turned, or carried by a base_link that is not at the floor."""

    def make(laser_rpy='0 0 0', base_above_floor_m=0.0, world='hallway'):
        robot = ElementTree.fromstring(expansion(RobotSource(ALTO)).urdf)
        robot.find("joint[@name='laser_joint']/origin").set('rpy', laser_rpy)
        carried = "joint/parent[@link='base_link']/../origin", "link[@name='base_link']/*/origin"
        for origin in (origin for path in carried for origin in robot.findall(path)):
            x, y, z = map(float, origin.get('xyz').split())
            origin.set('xyz', f'{x} {y} {z - base_above_floor_m}')
        path = tmp_path / 'mounted.urdf'
        path.write_text(ElementTree.tostring(robot, encoding='unicode'))
        return make_simulator(world, Pose2D(-10, 0.3, 0.5), robot=path, lidar={'noise': 0.0})

    return make


@pytest.mark.parametrize('quarters', [1, 3])
def test_a_turned_scanner_sees_the_same_in_its_own_frame(make_mounted, quarters):
    straight = make_mounted().scan()
    turned = make_mounted(f'0 0 {quarters * math.pi / 2}')
    assert turned.laser_pose_in_base[:2] == pytest.approx((0.12, 0.0))
    rays = np.roll(straight.ranges_m, -250 * quarters)
    seen = np.isfinite(rays) & (rays < 5.99)
    assert seen.sum() > 300
    assert turned.scan().ranges_m[seen] == pytest.approx(rays[seen], abs=1e-6)


@pytest.mark.parametrize('base_above_floor_m', [0.0, 0.1])
def test_the_scan_plane_is_above_the_floor_wherever_base_link_is(make_mounted, tmp_path, base_above_floor_m):
    """A wall that ends 5 cm above the scan plane, and one that ends 5 cm below it."""
    walls = [(f'{x_m} 0 {top_m / 2}', f'0.2 40 {top_m}') for x_m, top_m in ((-8.0, 1.07), (-7.0, 1.17))]
    world = box_world(tmp_path / 'walls.world', *walls)
    ranges_m = make_mounted('0 0 -0.5', base_above_floor_m, world).scan().ranges_m
    assert ranges_m[500] == pytest.approx(-7.1 + 10 - 0.12 * math.cos(0.5), abs=1e-4)
