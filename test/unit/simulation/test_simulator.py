"""The stand-in for Gazebo: repeatable and resettable, its drive, errors of wheels, other robots, and the scanner."""

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.simulation.simulator import (
    DriveController,
    DriveParams,
    Simulator,
    SimulatorParams,
    WheelErrorParams,
)
from diff_encoder_sim.simulation.state import PlanarVelocity
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from generated_robots import LASER, LEFT, RECIPES, RIGHT, Recipe, urdf_of
from places import ROOT
from simulated_drive import RADIUS_M, SEPARATION_M, drive


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
    phases = np.array([make_simulator(seed=seed).joint_states().angles_rad for seed in range(4)])
    assert ((0 <= phases) & (phases < 2 * math.pi)).all()
    assert len(np.unique(phases)) == 8
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


SECOND = 1_000_000_000


def controller(**params):
    return DriveController(DriveParams(**params), wheel_radius_m=0.1, wheel_separation_m=0.4)


def settled(drive, linear, angular):
    """Wheel speeds after the ramps."""
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


def test_the_ramp_keeps_the_acceleration_limit():
    drive = controller(max_linear_acceleration=0.5)
    drive.command(0, 1.0, 0.0)
    speeds = [drive.wheel_speeds_radps(0, 0.01)[0] * 0.1 for _ in range(3)]
    assert speeds == pytest.approx([0.005, 0.010, 0.015])


def test_what_is_beyond_the_limits_is_cut_with_a_warning(caplog):
    assert settled(controller(max_linear_speed=0.5), 99.0, 0.0) == pytest.approx((5.0, 5.0))
    assert 'exceeds the limits' in caplog.text


@pytest.mark.parametrize('command', [(math.nan, 0.0), (0.0, math.inf), (-math.inf, math.nan)])
def test_a_command_that_is_not_finite_is_refused_and_the_last_one_stays(command):
    drive = controller()
    settled(drive, 0.4, 0.0)
    with pytest.raises(InputFault, match='finite'):
        drive.command(2 * SECOND, *command)
    assert drive.wheel_speeds_radps(2 * SECOND, 0.01) == pytest.approx((4.0, 4.0))


def test_without_commands_the_robot_stops():
    drive = controller(command_timeout=0.5)
    settled(drive, 0.4, 0.5)
    last = 199 * SECOND // 100
    assert drive.wheel_speeds_radps(last + SECOND // 2, 0.01) == pytest.approx((3.0, 5.0))
    for tick in range(51, 200):
        speeds = drive.wheel_speeds_radps(last + tick * SECOND // 100, 0.01)
    assert speeds == (0.0, 0.0)


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
    (sample,) = encoder.update(*simulator.joint_states()[:3])
    estimate = odometry.update(*sample)
    for linear, angular, seconds in phases:
        for _ in range(round(100 * seconds)):
            simulator.command(linear, angular)
            simulator.tick()
            for sample in encoder.update(*simulator.joint_states()[:3]):
                estimate = odometry.update(*sample)
    return estimate


@pytest.mark.parametrize('name', ['mirrored axes, tyre and hub', 'laser aside, axle ahead of the root'])
def test_odometry_of_joint_states_is_where_the_robot_is(make, name):
    """Axes that point to the right, and a base_link behind the axle."""
    recipe = RECIPES[name]
    simulator = make(recipe, lidar={'noise': 0.0})
    encoder = ReportingEncoder(
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


@pytest.fixture
def make_mounted(tmp_path):
    """ALTO with its laser turned, or carried by a base_link that is not at the floor."""
    made = []

    def make(laser_rpy='0 0 0', base_above_floor_m=0.0, world='hallway', **params):
        robot = ElementTree.fromstring(expand(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')))
        robot.find("joint[@name='laser_joint']/origin").set('rpy', laser_rpy)
        carried = [
            *robot.findall("joint/parent[@link='base_link']/../origin"),
            *robot.findall("link[@name='base_link']/*/origin"),
        ]
        for origin in carried:
            x, y, z = map(float, origin.get('xyz').split())
            origin.set('xyz', f'{x} {y} {z - base_above_floor_m}')
        path = tmp_path / 'mounted.urdf'
        path.write_text(ElementTree.tostring(robot, encoding='unicode'))
        world_file = world if isinstance(world, Path) else ROOT / 'worlds' / f'{world}.world'
        made.append(Simulator(world_file, path, SimulatorParams.from_mapping(params, ''), Pose2D(-10, 0.3, 0.5), 1))
        return made[-1]

    yield make
    for simulator in made:
        simulator.close()


@pytest.mark.parametrize('quarters', [1, 2, 3])
def test_a_turned_scanner_sees_the_same_in_its_own_frame(make_mounted, quarters):
    straight = make_mounted(lidar={'noise': 0.0}).scan()
    turned = make_mounted(f'0 0 {quarters * math.pi / 2}', lidar={'noise': 0.0})
    assert turned.laser_pose_in_base[:2] == pytest.approx((0.12, 0.0))
    rays = np.roll(straight.ranges_m, -250 * quarters)
    seen = np.isfinite(rays) & (rays < 5.99)
    assert seen.sum() > 300
    assert turned.scan().ranges_m[seen] == pytest.approx(rays[seen], abs=1e-6)


def test_a_scanner_that_is_not_level_is_refused(make_mounted):
    with pytest.raises(ConfigError, match="mounted.urdf: given 'laser' .* leans by 29 degrees; allowed: .*5 degrees"):
        make_mounted('0 0.5 0')


def test_the_scan_plane_is_above_the_floor_wherever_base_link_is(make_mounted, tmp_path):
    """A wall that ends 5 cm above the scan plane, and one that ends 5 cm below it."""
    walls = ''.join(
        f'''<model name="{name}"><static>true</static><pose>{x_m} 0 {top_m / 2} 0 0 0</pose><link name="l">
        <collision name="c"><geometry><box><size>0.2 40 {top_m}</size></box></geometry></collision></link></model>'''
        for name, x_m, top_m in (('low', -8.0, 1.07), ('high', -7.0, 1.17))
    )
    world = tmp_path / 'walls.world'
    world.write_text(f"""<sdf version="1.6"><world name="walls"><model name="floor"><static>true</static><link name="l">
        <collision name="c"><geometry><plane/></geometry></collision></link></model>{walls}</world></sdf>""")
    laser_x_m = -10 + 0.12 * math.cos(0.5)
    for base_above_floor_m in (0.0, 0.1):
        ranges_m = make_mounted('0 0 -0.5', base_above_floor_m, world, lidar={'noise': 0.0}).scan().ranges_m
        assert ranges_m[500] == pytest.approx(-7.1 - laser_x_m, abs=1e-4), base_above_floor_m
