"""Robots as the simulator and PyBullet load them."""

import math
from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from diff_encoder_sim.robots import simulated_robot
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.simulated_robot import GeometryErrors, TrueWheels, joined_links, physics_urdf, sound_wheels
from diff_encoder_sim.robots.solids import MassProperties, merged
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion
from generated_robots import LEFT, RECIPES, RIGHT, Recipe, urdf_of
from places import ROOT
from urdf_texts import joint, link

ALTO = RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')
JOINTS = 'left_wheel_joint', 'right_wheel_joint'


def load(source=ALTO, errors=GeometryErrors()):
    return simulated_robot.load_simulated_robot(source, RobotChoices(), errors)


@pytest.fixture
def generated(tmp_path):
    def source_of(given=None, **recipe):
        path = tmp_path / 'robot.urdf'
        path.write_text(urdf_of(given or Recipe(**recipe), tmp_path))
        return RobotSource(path)

    return source_of


def test_alto_is_table_1_of_the_paper_and_simulated_as_it_is():
    alto = load()
    description = alto.description
    assert (description.tree.name, description.laser.link) == ('alto', 'laser')
    assert alto.wheels == pytest.approx((0.1, 0.1, 0.4))
    assert (description.mass.mass_kg, *description.mass.com_m[:2]) == pytest.approx((80.0, 0.05, 0.0))
    assert [contact.name for contact in description.contacts] == ['front_caster', 'rear_caster']
    assert (alto.urdf, alto.floor_only_links) == (joined_links(parse_urdf(expansion(ALTO).urdf, '')), ())


def test_errors_are_arguments_of_a_file_that_has_them_unless_they_have_another_effect(tmp_path):
    alto = load(errors=GeometryErrors(0.01, -0.02, 0.05))
    assert alto.wheels == pytest.approx((0.101, 0.098, 0.42))
    assert alto.floor_only_links == ()
    assert alto.description.wheel_diameter_m == 0.2  # nominal
    path, error = tmp_path / 'robot.urdf.xacro', '$(arg wheel_separation_error)'
    path.write_text(ALTO.file.read_text().replace(f'* (1 + {error})', f'+ {error}'))
    other = load(RobotSource(path), GeometryErrors(separation=0.05))
    assert other.wheels == pytest.approx((0.1, 0.1, 0.42))
    assert other.floor_only_links == simulated_robot.FLOOR_ONLY_LINKS


def test_errors_of_any_other_robot_change_its_wheels_which_may_turn_backward_and_keep_them_on_the_floor(generated):
    robot = load(generated(root_height_m=0.033, has_mirrored_axes=True), GeometryErrors(0.01, -0.02, 0.05))
    left_m, right_m, separation_m = robot.wheels
    assert robot.wheels == pytest.approx((0.033 * 1.01, 0.033 * 0.98, 0.16 * 1.05))
    assert robot.joints == (LEFT, RIGHT) and robot.floor_only_links == simulated_robot.FLOOR_ONLY_LINKS
    assert robot.forward_signs == (1.0, -1.0)
    urdf = ElementTree.fromstring(robot.urdf)
    for name, axle, radius_m, side in (('left_wheel', LEFT, left_m, 0.5), ('right_wheel', RIGHT, right_m, -0.5)):
        assert float(urdf.find(f"link[@name='{name}']//sphere").get('radius')) == radius_m
        place_m = [float(text) for text in urdf.find(f"joint[@name='{axle}']/origin").get('xyz').split()]
        assert place_m == pytest.approx([0.0, side * separation_m, radius_m - 0.033])


# A hub cap turns with its wheel, on a bent bracket; it grips as nothing else does.
CAP = """<link name="cap">
    <inertial><origin xyz="0.01 0 0.02"/><mass value="0.1"/>
      <inertia ixx="1e-3" iyy="2e-3" izz="2.5e-3" ixy="0" ixz="0" iyz="1e-4"/></inertial>
    <contact><lateral_friction value="0.3"/></contact>
    <collision><origin xyz="0 0.01 0.05" rpy="0.4 0.1 0.7"/>
      <geometry><box size="0.01 0.02 0.03"/></geometry></collision>
    <collision><origin xyz="0 0.01 0.05"/><geometry><box size="0.01 0.02 0.03"/></geometry></collision>
  </link>
  <joint name="cap_joint" type="fixed"><parent link="left_wheel"/><child link="cap"/>
    <origin xyz="0 0.03 0.01" rpy="0.1 0.2 0.3"/></joint>"""


@pytest.fixture(params=['', CAP], ids=['alto', 'with a hub cap'])
def tree(request):
    return parse_urdf(expansion(ALTO).urdf.replace('</robot>', f'{request.param}</robot>'), 'alto')


@pytest.fixture
def joined(tree):
    return parse_urdf(joined_links(tree), 'joined')


def part_masses(tree):
    """Mass, centre and inertia in the root of each part that moves as one: the body and both wheels."""
    tops = {top: [] for top in (tree.root, *(tree.joints[name].child for name in JOINTS))}
    for name, each in tree.links.items():
        above = (name, *(joint.parent for joint in tree.joints_above(name)))
        if each.inertial is not None:
            tops[next(link for link in above if link in tops)].append(each.inertial.moved(tree.poses[name]))
    return {top: merged(masses) for top, masses in tops.items()}


def shapes(tree):
    """The friction (PyBullet's if none is given), geometry and place of each shape."""
    found = []
    for name, each in tree.links.items():
        friction = 0.5 if each.friction is None else each.friction
        found += [(friction, str(s.geometry), s.placed(tree.poses[name])[1].round(9).tolist()) for s in each.collisions]
    return sorted(found)


def test_each_moving_part_keeps_its_mass_and_inertia_and_each_shape_its_place_and_friction(tree, joined):
    found, expected = part_masses(joined), part_masses(tree)
    assert found.keys() == expected.keys()
    for number, of_all in ((number, of_all) for top in found for number, of_all in zip(found[top], expected[top])):
        assert number == pytest.approx(of_all, rel=1e-9, abs=1e-12)
    assert shapes(joined) == shapes(tree)


def test_the_wheels_turn_as_before_and_are_as_sound(tree, joined):
    assert sound_wheels(joined, *JOINTS) == pytest.approx(sound_wheels(tree, *JOINTS))
    for found, expected in ((joined.joints[name], tree.joints[name]) for name in JOINTS):
        assert (found.child, found.kind, found.effort) == (expected.child, expected.kind, expected.effort)
        assert found.axis.tolist() == expected.axis.tolist()
        assert joined.poses[found.child] == pytest.approx(tree.poses[found.child], abs=1e-12)
    # A link is left for each friction of a part, wheels first.
    cap = ['cap'] if 'cap' in tree.links else []
    assert sorted(joined.links) == sorted(['base_link', 'front_caster', 'left_wheel', 'right_wheel', *cap])
    assert [*joined.joints][:2] == [*JOINTS]


def mass_in_pybullet(path, urdf):
    """What PyBullet has of all links; a root link is placed at the world's origin."""
    path.write_text(urdf)
    client = pybullet.connect(pybullet.DIRECT)
    robot = pybullet.loadURDF(str(path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
    places = [pybullet.getBasePositionAndOrientation(robot, physicsClientId=client)]
    for index in range(pybullet.getNumJoints(robot, physicsClientId=client)):
        places.append(pybullet.getLinkState(robot, index, computeForwardKinematics=True, physicsClientId=client)[:2])
    masses = []
    for index, (com_m, quaternion) in enumerate(places, -1):
        mass_kg, _, moments_kgm2 = pybullet.getDynamicsInfo(robot, index, physicsClientId=client)[:3]
        turn = np.array(pybullet.getMatrixFromQuaternion(quaternion)).reshape(3, 3)
        masses.append(MassProperties(mass_kg, np.array(com_m), turn @ np.diag(moments_kgm2) @ turn.T))
    pybullet.disconnect(client)
    return merged(masses)


def nominal(description):
    return TrueWheels(description.radius_m, description.radius_m, description.wheel_separation_m)


@pytest.mark.parametrize('name', list(RECIPES))
def test_pybullet_has_the_mass_and_the_inertia_of_the_description(name, generated, tmp_path):
    description = describe(generated(RECIPES[name]))
    whole = mass_in_pybullet(tmp_path / 'physics.urdf', physics_urdf(description, nominal(description)))
    expected = description.mass
    assert whole.mass_kg == pytest.approx(expected.mass_kg)
    assert whole.com_m == pytest.approx(expected.com_m, abs=1e-6)
    assert whole.inertia_kgm2 == pytest.approx(expected.inertia_kgm2, rel=1e-4, abs=1e-6 * whole.mass_kg)


def test_a_light_body_between_heavy_wheels_keeps_an_inertia_that_a_body_can_have(generated):
    """What is left of the robot's inertia without the simulated wheels' would be negative."""
    small = {'body_m': (0.02, 0.02, 0.02), 'body_x_m': 0.0, 'com_m': (0.0, 0.0, 0.02)}
    description = describe(generated(separation_m=0.5, has_inertia=False, **small))
    inertia = ElementTree.fromstring(physics_urdf(description, nominal(description))).find('link/inertial/inertia')
    xx, yy, zz = sorted(float(inertia.get(key)) for key in ('ixx', 'iyy', 'izz'))
    assert 0 < xx and zz <= xx + yy


def test_wheels_are_obstacles_as_wide_as_the_footprint(generated):
    description = describe(generated(body_m=(0.14, 0.1, 0.14)))
    robot = ElementTree.fromstring(physics_urdf(description, nominal(description)))
    cylinders = robot.findall("link[@name='body']/collision/geometry/cylinder/../..")
    assert len(cylinders) == 2
    for cylinder in cylinders:
        half_m = 0.5 * float(cylinder.find('geometry/cylinder').get('length'))
        y_m = float(cylinder.find('origin').get('xyz').split()[1])
        assert abs(y_m) + half_m == pytest.approx(max(y for _, y in description.footprint))
        assert float(cylinder.find('origin').get('rpy').split()[0]) == pytest.approx(math.pi / 2)


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
        ('</robot>', f'{link("frame")}{joint("frame", "frame", "0 0 0", parent="hull")}</robot>'),
        ('<mass value="0.5"/>', '<mass value="0"/>'),
        ('joint name="laser_joint" type="fixed"', 'joint name="laser_joint" type="continuous"'),
        ('<box size="0.5 0.6 0.99"/>', '<mesh filename="body.stl"/>'),
    ],
)
def test_what_is_not_right_in_it_makes_a_urdf_unsound(old, new):
    urdf = expansion(ALTO).urdf.replace('0.043000000000000003', '0.043')
    assert old in urdf
    assert sound_wheels(parse_urdf(urdf, 'alto'), *JOINTS) == pytest.approx((0.1, 0.1, 0.4))
    assert sound_wheels(parse_urdf(urdf.replace(old, new), 'alto'), *JOINTS) is None
