"""PyBullet: true to wheel kinematics, with the masses of the robot file; imported quietly, and only to simulate."""

import math
import os
import re
import subprocess
import sys

import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expansion
from diff_encoder_sim.simulation.state import PlanarVelocity
from places import ROOT, SOURCE
from simulated_drive import RADIUS_M, SEPARATION_M, box_world, drive
from trial_bags import trial, write_bag

ALTO = expansion(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')).urdf


@pytest.mark.parametrize('speed', [0.45, -0.45])
def test_20_m_straight_agree_with_wheel_kinematics_to_a_thousandth(make_simulator, speed):
    start_m = -math.copysign(10, speed)
    simulator = make_simulator(start=Pose2D(start_m, 0, 0))
    wheels, turned = drive(simulator, speed, 0.0, 20 / 0.45)
    rolled_m = RADIUS_M * wheels.mean()
    assert abs(rolled_m) > 19.5
    assert simulator.physics.base_pose_in_plane().x_m - start_m == pytest.approx(rolled_m, rel=1e-3)
    assert turned == pytest.approx(RADIUS_M * (wheels[1] - wheels[0]) / SEPARATION_M, abs=1e-3)
    assert abs(math.degrees(turned)) < 0.1  # and it is straight
    assert simulator.physics.obstacle_hit() is None


def masses_kg(simulator):
    physics = simulator.physics
    return [physics._bullet.getDynamicsInfo(physics._robot, link)[0] for link in physics._links]


def test_the_velocity_of_a_placed_robot_is_that_of_its_base(make_simulator):
    """Its centre of mass, 0.05 m ahead, moves otherwise when it turns."""
    simulator = make_simulator()
    simulator.physics.place(Pose2D(1.0, 0.5, 1.0), PlanarVelocity(0.2, -0.1, 0.7))
    base = simulator.physics.base()
    assert base.linear_xyz_mps == pytest.approx((0.2, -0.1, 0.0), abs=1e-3)
    assert base.angular_xyz_radps == pytest.approx((0.0, 0.0, 0.7), abs=1e-9)


def test_pybullet_has_the_masses_of_the_robot_file(make_simulator):
    """The front caster's load shows where the centre of mass is: 0.05 m ahead."""
    simulator = make_simulator()
    assert sum(masses_kg(simulator)) == pytest.approx(80.0)
    for _ in range(20):
        simulator.tick()
    on_caster = 0.05 / 0.19
    loads = {'front_caster': on_caster, 'left_wheel': (1 - on_caster) / 2, 'right_wheel': (1 - on_caster) / 2}
    expected = {f'{name}_joint': load for name, load in loads.items()}
    assert simulator.physics.floor_loads() == pytest.approx(expected, rel=0.01)


def test_a_robot_of_many_parts_has_all_of_their_mass(make_simulator, tmp_path):
    """PyBullet cuts lines of a URDF after 8191 characters, which may be within a number."""
    part = """<link name="part_{0}"><inertial><origin xyz="0 0 0.5"/><mass value="0.123456789"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
      <collision><origin xyz="0 0 0.5"/><geometry><box size="0.1 0.1 0.123456789"/></geometry></collision></link>
      <joint name="part_{0}" type="fixed"><parent link="hull"/><child link="part_{0}"/></joint>"""
    for count in (51, 120):
        robot = tmp_path / f'{count}.urdf'
        robot.write_text(ALTO.replace('</robot>', ''.join(map(part.format, range(count))) + '</robot>'))
        total_kg = sum(masses_kg(make_simulator(robot=robot)))
        assert total_kg == pytest.approx(80.0 + 0.123456789 * count, rel=1e-9)


@pytest.mark.parametrize(('speed_mps', 'braking_mps2', 'wall_x_m'), [(4.0, 100.0, 9.2), (5.0, 20.0, 9.9)])
def test_a_robot_that_slides_into_a_wall_touches_it(make_simulator, tmp_path, speed_mps, braking_mps2, wall_x_m):
    """Its wheels stand, told to stop 8 m after the start, out of sight of the wall."""
    world = box_world(tmp_path / 'wall.world', (f'{wall_x_m} 0 0.5', '0.1 10 1'))
    drive = {'max_linear_speed': 20.0, 'max_linear_acceleration': braking_mps2, 'wheel_torque': 200.0}
    simulator, hits = make_simulator(world, Pose2D(0.0, 0.0, 0.0), drive=drive), set()
    for _ in range(500):
        simulator.command(speed_mps if simulator.physics.base_pose_in_plane().x_m < 8.0 else 0.0, 0.0)
        simulator.tick()
        hits.add(simulator.physics.obstacle_hit())
    assert hits == {None, f'at {wall_x_m} 0 0.5/l/c'}
    assert simulator.physics.base_pose_in_plane().x_m < wall_x_m


def test_importing_pybullet_prints_nothing_and_later_prints_are_seen():
    script = 'from diff_encoder_sim.simulation.physics import pybullet; pybullet.DIRECT; print("after")'
    environment = {'PYTHONPATH': str(SOURCE), 'PATH': ''}
    result = subprocess.run([sys.executable, '-c', script], env=environment, capture_output=True, text=True)
    assert (result.stdout, result.stderr) == ('after\n', '')


MISSING = r'diff-encoder-sim [\w-]+: PyBullet, .* not installed; .*calibrate, .* pip install pybullet, .*\[sim\].*'
# Run a command where PyBullet cannot be imported.
BEGIN = """
import runpy, sys
sys.modules['pybullet'] = None
sys.argv[:2] = ['diff-encoder-sim']
from diff_encoder_sim.cli.console import main
main()
"""


def run(folder, *arguments):
    environment = {**os.environ, 'PYTHONPATH': str(SOURCE)}
    command = [sys.executable, '-c', BEGIN, '-', *map(str, arguments)]
    return subprocess.run(command, env=environment, cwd=str(folder), capture_output=True, text=True)


@pytest.mark.parametrize(
    'arguments',
    ['check-robot burger', 'campaign --config quick --out results', 'advise --tolerance 0.05 --out results'],
)
def test_a_command_that_simulates_says_in_one_line_what_to_install(arguments, tmp_path):
    done = run(tmp_path, *arguments.split())
    (line,) = done.stderr.splitlines()
    assert done.returncode == 1 and re.fullmatch(MISSING, line)
    assert not (tmp_path / 'results').exists()


def test_what_does_not_simulate_works(tmp_path):
    write_bag(tmp_path / 'a.bag', trial())
    world = SOURCE.parent / 'worlds' / 'hallway.world'
    for arguments in (['analyze', 'a.bag'], ['rasterise-world', world, '--out', 'map'], ['reencode', '--help']):
        done = run(tmp_path, *arguments)
        assert (done.returncode, done.stderr) == (0, '')
    assert (tmp_path / 'analysis' / 'report.html').exists() and (tmp_path / 'map.yaml').exists()
