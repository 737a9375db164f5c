"""The stand-in for Gazebo: true to wheel kinematics, repeatable, and wrong only when asked."""

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.typed_params import load_params
from diff_encoder_sim.simulation.robot import load_robot
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import PlanarVelocity
from places import ROOT

RADIUS_M, SEPARATION_M = 0.1, 0.4


@pytest.fixture
def make_simulator():
    made = []

    def make(world='hallway', start=Pose2D(-10, 0, 0), seed=1, **params):
        simulator = Simulator(
            ROOT / 'worlds' / f'{world}.world',
            ROOT / 'urdf' / 'alto.urdf.xacro',
            SimulatorParams.from_mapping(params, 'test'),
            start,
            seed,
        )
        made.append(simulator)
        return simulator

    yield make
    for simulator in made:
        simulator.close()


def drive(simulator, linear, angular, seconds):
    """Drive with ramps; returns wheel angles turned (2) and the true yaw turned [rad]."""
    before = np.array(simulator.joint_states().angles_rad)
    yaw, turned = simulator.base_pose_in_world().yaw_rad, 0.0
    for tick in range(round(seconds * 100) + 100):
        if tick % 5 == 0:
            ramp = min(1.0, (tick + 5) / 60)
            stopping = tick >= seconds * 100
            simulator.command(0.0 if stopping else ramp * linear, 0.0 if stopping else ramp * angular)
        simulator.tick()
        now = simulator.base_pose_in_world().yaw_rad
        turned += (now - yaw + math.pi) % (2 * math.pi) - math.pi
        yaw = now
    return np.array(simulator.joint_states().angles_rad) - before, turned


@pytest.mark.parametrize('speed', [0.45, -0.45])
def test_20_m_straight_agrees_with_wheel_kinematics_to_a_thousandth(make_simulator, speed):
    start_m = -math.copysign(10, speed)
    simulator = make_simulator(start=Pose2D(start_m, 0, 0))
    wheels, turned = drive(simulator, speed, 0.0, 20 / 0.45)
    end = simulator.base_pose_in_world()
    rolled_m = RADIUS_M * wheels.mean()
    assert abs(rolled_m) > 19.5
    assert end.x_m - start_m == pytest.approx(rolled_m, rel=1e-3)
    wheel_yaw = RADIUS_M * (wheels[1] - wheels[0]) / SEPARATION_M
    assert turned == pytest.approx(wheel_yaw, abs=1e-3)
    assert abs(math.degrees(turned)) < 0.1  # and it is straight
    assert simulator.obstacle_hit() is None


@pytest.mark.parametrize('rate', [1.0, -1.0])
def test_five_turns_agree_with_wheel_kinematics_to_a_thousandth(make_simulator, rate):
    simulator = make_simulator('ros_logo', Pose2D(-3.4, -0.85, 0.3))
    wheels, turned = drive(simulator, 0.0, rate, 10 * math.pi)
    wheel_yaw = RADIUS_M * (wheels[1] - wheels[0]) / SEPARATION_M
    assert abs(turned) > 9.5 * math.pi
    assert turned == pytest.approx(wheel_yaw, rel=1e-3)
    end = simulator.base_pose_in_world()
    assert math.hypot(end.x_m + 3.4, end.y_m + 0.85) < 0.005


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


def test_the_velocity_of_a_placed_robot_is_that_of_its_base(make_simulator):
    """Its centre of mass, 0.05 m ahead, moves otherwise when it turns."""
    simulator = make_simulator()
    simulator.place(Pose2D(1.0, 0.5, 1.0), PlanarVelocity(0.2, -0.1, 0.7))
    base = simulator.base()
    assert base.linear_xyz_mps == pytest.approx((0.2, -0.1, 0.0), abs=1e-3)
    assert base.angular_xyz_radps == pytest.approx((0.0, 0.0, 0.7), abs=1e-9)


def test_it_starts_at_rest_exactly_where_it_was_put(make_simulator):
    simulator = make_simulator('ros_logo', Pose2D(-3.4, -0.85, 2.0))
    assert tuple(simulator.base_pose_in_world()) == pytest.approx((-3.4, -0.85, 2.0), abs=1e-6)
    for _ in range(100):
        simulator.tick()
    assert tuple(simulator.base_pose_in_world()) == pytest.approx((-3.4, -0.85, 2.0), abs=1e-4)
    assert abs(simulator.base().position_xyz_m[2]) < 1e-3


def test_pybullet_has_the_masses_of_the_robot_file(make_simulator):
    """The front caster's share of the weight tells where the centre of mass is: 0.05 m ahead."""
    simulator = make_simulator()
    robot, client = simulator._physics._robot, simulator._physics._client
    links = range(-1, pybullet.getNumJoints(robot, physicsClientId=client))
    masses_kg = [pybullet.getDynamicsInfo(robot, link, physicsClientId=client)[0] for link in links]
    assert sum(masses_kg) == pytest.approx(80.0)
    load_n: dict = {}
    for _ in range(20):
        simulator.tick()
    for contact in pybullet.getContactPoints(bodyA=robot, physicsClientId=client):
        name = pybullet.getJointInfo(robot, contact[3], physicsClientId=client)[1].decode()
        load_n[name] = load_n.get(name, 0.0) + contact[9]
    # Shares: PyBullet gives the force of a sub-step over the whole step.
    share = {name: load / sum(load_n.values()) for name, load in load_n.items()}
    caster_share = 0.05 / 0.19
    assert share == pytest.approx(
        {
            'front_caster_joint': caster_share,
            'left_wheel_joint': (1 - caster_share) / 2,
            'right_wheel_joint': (1 - caster_share) / 2,
        },
        rel=0.01,
    )


def test_running_into_a_wall_is_noticed(make_simulator):
    simulator = make_simulator(start=Pose2D(14.5, 0, 0))
    drive(simulator, 0.8, 0.0, 3.0)
    assert 'hallway' in simulator.obstacle_hit()


def test_a_radius_error_makes_both_wheels_disagree_with_the_odometry(make_simulator):
    simulator = make_simulator(wheel_errors={'left_radius_error': -0.01, 'right_radius_error': -0.01})
    wheels, _ = drive(simulator, 0.45, 0.0, 10.0)
    driven_m = simulator.base_pose_in_world().x_m + 10
    assert driven_m / (RADIUS_M * wheels.mean()) == pytest.approx(0.99, abs=2e-4)


def test_a_separation_error_makes_turns_disagree_with_the_odometry(make_simulator):
    simulator = make_simulator('ros_logo', Pose2D(-3.4, -0.85, 0), wheel_errors={'wheel_separation_error': 0.02})
    wheels, turned = drive(simulator, 0.0, 1.0, 2 * math.pi)
    believed = RADIUS_M * (wheels[1] - wheels[0]) / SEPARATION_M
    assert turned / believed == pytest.approx(1 / 1.02, abs=2e-4)


def test_slip_turns_the_wheel_farther_than_the_robot_goes(make_simulator):
    simulator = make_simulator(wheel_errors={'left_slip': 0.05, 'right_slip': 0.05})
    wheels, _ = drive(simulator, 0.45, 0.0, 10.0)
    driven_m = simulator.base_pose_in_world().x_m + 10
    assert driven_m / (RADIUS_M * wheels.mean()) == pytest.approx(0.95, abs=2e-4)
    assert RADIUS_M * wheels.mean() == pytest.approx(0.45 * 10, rel=0.05)  # wheels obey commands


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


# --- the scanner's mount ---


@pytest.fixture
def make_mounted(tmp_path):
    """ALTO with its laser turned, or carried by a base_link that is not at the floor."""
    made = []

    def make(laser_rpy='0 0 0', base_above_floor_m=0.0, world='hallway', **params):
        alto = load_robot(ROOT / 'urdf' / 'alto.urdf.xacro', 'left_wheel_joint', 'right_wheel_joint', {})
        robot = ElementTree.fromstring(alto.urdf)
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


@pytest.mark.parametrize(('rpy', 'lean'), [('0 0.5 0', '29'), (f'{math.pi} 0 0', '180')])
def test_a_scanner_that_is_not_level_is_refused(make_mounted, rpy, lean):
    with pytest.raises(ConfigError, match=f"mounted.urdf: link 'laser': leans by {lean} degrees; allowed: .*5 degrees"):
        make_mounted(rpy)


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


def test_errors_that_a_robot_file_cannot_express_are_refused(tmp_path):
    plain = tmp_path / 'plain.urdf.xacro'
    plain.write_text((ROOT / 'urdf' / 'alto.urdf.xacro').read_text().replace('$(arg wheel_separation_error)', '0'))
    params = SimulatorParams.from_mapping({'wheel_errors': {'wheel_separation_error': 0.1}}, '')
    with pytest.raises(ConfigError, match='wheel_separation_error has no effect'):
        Simulator(ROOT / 'worlds' / 'hallway.world', plain, params, Pose2D(0, 0, 0), 0)


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
