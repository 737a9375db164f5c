"""Links that are fixed to one another, joined: less to simulate, and the same robot."""

import numpy as np
import pytest

from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.simulated_robot import joined_links, sound_wheels
from diff_encoder_sim.robots.solids import link_mass, merged, placed
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand
from places import ROOT

JOINTS = 'left_wheel_joint', 'right_wheel_joint'
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
    urdf = expand(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'))
    return parse_urdf(urdf.replace('</robot>', f'{request.param}</robot>'), 'alto')


def joined(tree):
    return parse_urdf(joined_links(tree), 'joined')


def part_masses(tree):
    """Mass, centre and inertia in the root of each part that moves as one: the body and both wheels."""
    poses = tree.link_poses()
    tops = {tree.root: [], **{tree.joints[joint].child: [] for joint in JOINTS}}
    for name, link in tree.links.items():
        top = name
        while top not in tops:
            top = tree.joint_above(top).parent
        tops[top].append(link_mass(link.inertial, poses[name]))
    return {top: merged(masses) for top, masses in tops.items()}


def friction_of(link):
    return 0.5 if link.friction is None else link.friction  # PyBullet's default


def test_each_moving_part_keeps_its_mass_and_inertia(tree):
    found, expected = part_masses(joined(tree)), part_masses(tree)
    assert found.keys() == expected.keys()
    for top, right in expected.items():
        for number, of_all in zip(found[top], right):
            assert number == pytest.approx(of_all, rel=1e-9, abs=1e-12)


def test_each_shape_keeps_its_place_and_its_friction(tree):
    def shapes(tree):
        poses = tree.link_poses()
        return [
            (friction_of(link), placed(shape, poses[name]))
            for name, link in tree.links.items()
            for shape in link.collisions
        ]

    left = shapes(joined(tree))
    for friction, (geometry, pose) in shapes(tree):
        same = [
            index
            for index, found in enumerate(left)
            if (found[0], found[1].geometry) == (friction, geometry) and np.allclose(found[1].pose_in_link, pose)
        ]
        del left[same[0]]
    assert not left


def test_the_wheels_turn_as_before_and_are_as_sound(tree):
    robot = joined(tree)
    assert sound_wheels(robot, *JOINTS) == pytest.approx(sound_wheels(tree, *JOINTS))
    for name in JOINTS:
        joint, expected = robot.joints[name], tree.joints[name]
        assert (joint.child, joint.kind, joint.effort, joint.speed) == (
            expected.child, expected.kind, expected.effort, expected.speed,
        )  # fmt: skip
        assert joint.axis.tolist() == expected.axis.tolist()
        assert robot.link_poses()[joint.child] == pytest.approx(tree.link_poses()[joint.child], abs=1e-12)


def test_a_link_is_left_for_each_friction_of_a_part_wheels_first(tree):
    robot = joined(tree)
    cap = ['cap'] if 'cap' in tree.links else []
    assert sorted(robot.links) == sorted(['base_link', 'front_caster', 'left_wheel', 'right_wheel', *cap])
    assert [*robot.joints][:2] == [*JOINTS]
