"""The scanner's mount on the robot."""

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from places import ROOT


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
