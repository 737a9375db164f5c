"""What PyBullet loads for a robot: its mass, its wheels, its outline."""

import math
from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.simulated_robot import TrueWheels, physics_urdf, sound_wheels
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand
from generated_robots import LEFT, RECIPES, RIGHT, Recipe, urdf_of
from places import ROOT


@pytest.fixture
def describe_recipe(tmp_path):
    def describe_it(recipe):
        path = tmp_path / 'robot.urdf'
        path.write_text(urdf_of(recipe, tmp_path))
        return describe(RobotSource(path))

    return describe_it


@pytest.fixture
def load(tmp_path):
    """Loads a URDF; returns what PyBullet has of each link by its name: mass, centre and inertia in the root."""
    client = pybullet.connect(pybullet.DIRECT)

    def load_it(urdf):
        path = tmp_path / 'physics.urdf'
        path.write_text(urdf)
        robot = pybullet.loadURDF(str(path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
        links = {}
        for index in range(-1, pybullet.getNumJoints(robot, physicsClientId=client)):
            dynamics = pybullet.getDynamicsInfo(robot, index, physicsClientId=client)
            position, quat = _centre_of_mass(robot, index, client, dynamics)
            turn = np.array(pybullet.getMatrixFromQuaternion(quat)).reshape(3, 3)
            name = 'body' if index < 0 else pybullet.getJointInfo(robot, index, physicsClientId=client)[12].decode()
            links[name] = dynamics[0], np.array(position), turn @ np.diag(dynamics[2]) @ turn.T
        return links

    yield load_it
    pybullet.disconnect(client)


def _centre_of_mass(robot, index, client, dynamics):
    if index < 0:
        return dynamics[3], dynamics[4]
    state = pybullet.getLinkState(robot, index, computeForwardKinematics=True, physicsClientId=client)
    base = pybullet.getBasePositionAndOrientation(robot, physicsClientId=client)
    inertial = pybullet.getDynamicsInfo(robot, -1, physicsClientId=client)[3:5]
    root = pybullet.multiplyTransforms(*base, *pybullet.invertTransform(*inertial))
    return pybullet.multiplyTransforms(*pybullet.invertTransform(*root), *state[:2])


def nominal(description):
    radius_m = 0.5 * description.wheel_diameter_m
    return TrueWheels(radius_m, radius_m, description.wheel_separation_m)


@pytest.mark.parametrize('name', list(RECIPES))
def test_pybullet_has_the_mass_and_the_inertia_of_the_description(name, describe_recipe, load):
    description = describe_recipe(RECIPES[name])
    links = load(physics_urdf(description, nominal(description)))
    mass_kg = sum(mass for mass, _, _ in links.values())
    com_m = sum(mass * place_m for mass, place_m, _ in links.values()) / mass_kg
    inertia_kgm2 = sum(
        inertia + mass * (np.dot(arm := place_m - com_m, arm) * np.eye(3) - np.outer(arm, arm))
        for mass, place_m, inertia in links.values()
    )
    assert mass_kg == pytest.approx(description.mass.mass_kg)
    assert com_m == pytest.approx(description.mass.com_m, abs=1e-6)
    assert inertia_kgm2 == pytest.approx(description.mass.inertia_kgm2, rel=1e-4, abs=1e-6 * mass_kg)


def test_errors_of_the_wheels_change_the_wheels_and_keep_them_on_the_floor(describe_recipe):
    description = describe_recipe(Recipe(root_height_m=0.033))
    robot = ElementTree.fromstring(physics_urdf(description, TrueWheels(0.034, 0.031, 0.17)))
    for link, joint, radius_m, y_m in (('left_wheel', LEFT, 0.034, 0.085), ('right_wheel', RIGHT, 0.031, -0.085)):
        assert float(robot.find(f"link[@name='{link}']//sphere").get('radius')) == radius_m
        place_m = [float(text) for text in robot.find(f"joint[@name='{joint}']/origin").get('xyz').split()]
        assert place_m == pytest.approx([0.0, y_m, radius_m - 0.033])


def test_a_light_body_between_heavy_wheels_keeps_an_inertia_that_a_body_can_have(describe_recipe):
    """What is left of the robot's inertia without the simulated wheels' would be negative."""
    recipe = Recipe(
        body_m=(0.02, 0.02, 0.02), body_x_m=0.0, com_m=(0.0, 0.0, 0.02), separation_m=0.5, has_inertia=False
    )
    description = describe_recipe(recipe)
    inertia = ElementTree.fromstring(physics_urdf(description, nominal(description))).find('link/inertial/inertia')
    xx, yy, zz = sorted(float(inertia.get(key)) for key in ('ixx', 'iyy', 'izz'))
    assert 0 < xx and zz <= xx + yy


def test_wheels_are_obstacles_as_wide_as_the_footprint(describe_recipe):
    description = describe_recipe(Recipe(body_m=(0.14, 0.1, 0.14)))
    robot = ElementTree.fromstring(physics_urdf(description, nominal(description)))
    cylinders = robot.findall("link[@name='body']/collision/geometry/cylinder/../..")
    assert len(cylinders) == 2
    for cylinder in cylinders:
        half_m = 0.5 * float(cylinder.find('geometry/cylinder').get('length'))
        y_m = float(cylinder.find('origin').get('xyz').split()[1])
        assert abs(y_m) + half_m == pytest.approx(max(y for _, y in description.footprint))
        assert float(cylinder.find('origin').get('rpy').split()[0]) == pytest.approx(math.pi / 2)


ALTO = expand(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'))
JOINTS = 'left_wheel_joint', 'right_wheel_joint'
BARE_FRAME = """<link name="frame"/>
  <joint name="frame" type="fixed"><parent link="hull"/><child link="frame"/></joint>"""


def test_alto_is_sound():
    assert sound_wheels(parse_urdf(ALTO, 'alto'), *JOINTS) == pytest.approx((0.1, 0.1, 0.4))


@pytest.mark.parametrize(
    ('old', 'new'),
    [
        ('<sphere radius="0.1"/>', '<cylinder radius="0.1" length="0.02"/>'),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>'),
        ('<lateral_friction value="0"/>', '<lateral_friction value="0.5"/>'),
        ('<rolling_friction value="0"/>', '<rolling_friction value="0.01"/>'),
        ('xyz="-0.19 0 0.043"', 'xyz="-0.19 0 0.04"'),  # both casters touch
        ('xyz="0.19 0 0.04"', 'xyz="0.19 0 0.043"'),  # none does
        ('xyz="0.19 0 0.04"', 'xyz="0.19 0 0.039"'),  # it lifts the wheels
        ('</robot>', f'{BARE_FRAME}</robot>'),
        ('<mass value="0.5"/>', '<mass value="0"/>'),
        ('joint name="laser_joint" type="fixed"', 'joint name="laser_joint" type="continuous"'),
        ('<box size="0.5 0.6 0.99"/>', '<mesh filename="body.stl"/>'),
    ],
)  # fmt: skip
def test_what_is_not_right_in_it_makes_a_urdf_unsound(old, new):
    urdf = ALTO.replace('0.043000000000000003', '0.043')
    assert old in urdf
    assert sound_wheels(parse_urdf(urdf.replace(old, new), 'alto'), *JOINTS) is None


@pytest.mark.parametrize('name', list(RECIPES))
def test_robots_as_people_write_them_are_not_sound(name, tmp_path):
    assert sound_wheels(parse_urdf(urdf_of(RECIPES[name], tmp_path), 'robot'), LEFT, RIGHT) is None
