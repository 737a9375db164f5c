"""URDF text becomes a tree, or one line that names file and element."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.solids import Box, Cylinder, Mesh, Sphere
from diff_encoder_sim.robots.urdf_reading import parse_urdf, read_robot_text

LINKS = '<link name="base"/><link name="wheel"/><link name="laser"/>'
JOINTS = (
    '<joint name="axle" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 2 0"/></joint>'
    '<joint name="mount" type="fixed"><parent link="base"/><child link="laser"/><origin xyz="0.1 0 0.2"/></joint>'
)


def parse(body):
    return parse_urdf(f'<robot name="r">{body}</robot>', 'r.urdf')


def joint(name, parent, child):
    return f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'


def test_a_tree_of_links_is_read():
    tree = parse(LINKS + JOINTS)
    assert (tree.name, tree.root) == ('r', 'base')
    assert list(tree.subtree('base')) == list(tree.links) == ['base', 'wheel', 'laser']
    assert list(tree.joints) == ['axle', 'mount']
    assert tree.poses['laser'][:3, 3] == pytest.approx([0.1, 0, 0.2])
    assert tree.joints['axle'].axis == pytest.approx([0, 1, 0])


def in_link(body):
    return f'<link name="l">{body}</link>'


def link_of(body):
    return parse(in_link(body)).links['l']


def collision(geometry, inside=''):
    return f'<collision>{inside}<geometry>{geometry}</geometry></collision>'


def test_the_inertia_is_turned_into_the_links_axes_and_friction_is_that_of_pybullets_tag():
    inertial = link_of(
        '<inertial><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>'
        '<inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0.2" iyz="0.3"/></inertial>'
    ).inertial
    assert (inertial.mass_kg, list(inertial.com_m)) == (2, [1, 0, 0])
    expected = np.array([[2, -0.1, -0.3], [-0.1, 1, 0.2], [-0.3, 0.2, 2.5]])
    assert inertial.inertia_kgm2 == pytest.approx(expected)
    assert link_of('<contact><lateral_friction value="0.25"/></contact>').friction == 0.25
    assert link_of('<contact/>').friction is None


@pytest.mark.parametrize(
    ('geometry', 'expected'),
    [
        ('<box size="1 2 3"/>', Box((1, 2, 3))),
        ('<sphere radius="0.5"/>', Sphere(0.5)),
        ('<cylinder radius="0.5" length="2"/>', Cylinder(0.5, 2)),
        ('<capsule radius="0.5" length="2"/>', Cylinder(0.5, 3)),
        ('<mesh filename=" package://p/a.stl "/>', Mesh('package://p/a.stl', (1, 1, 1))),
        ('<mesh filename="a.stl" scale="0.001 -0.001 0.001"/>', Mesh('a.stl', (0.001, -0.001, 0.001))),
    ],
)
def test_shapes_are_read(geometry, expected):
    (shape,) = link_of(collision(geometry, '<origin xyz="0 0 0.1"/>')).collisions
    assert shape.geometry == expected
    assert list(shape.pose_in_link[:3, 3]) == [0, 0, 0.1]


@pytest.mark.parametrize(
    ('inside', 'notes'),
    [
        ('<collision/>', 1),
        (collision('<plane/>'), 1),
        (collision('<box size="0 0 0"/>'), 1),
        (collision('<sphere radius="-1"/>'), 1),
        ('<inertial/>', 1),
        ('<inertial><mass value="0"/></inertial>', 1),
        ('', 0),
        ('<visual/>', 0),
    ],
)
def test_what_is_ignored_is_noted(inside, notes):
    tree = parse(f'<link name="a">{inside}</link>')
    assert (tree.links['a'].inertial, tree.links['a'].collisions, tree.links['a'].visuals) == (None, (), ())
    assert len(tree.notes) == notes and all("link 'a'" in note for note in tree.notes)


ENDS = '<parent link="a"/><child link="b"/>'


def with_joint(body, kind='continuous'):
    return f'<link name="a"/><link name="b"/><joint name="j" type="{kind}">{body}</joint>'


def joint_of(*given):
    return parse(with_joint(*given)).joints['j']


def test_a_joint_has_all_that_is_given_and_else_what_urdf_says():
    limit, origin = '<limit effort="2.5" velocity="10"/>', '<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>'
    joint = joint_of(f'{ENDS}{origin}<axis xyz="0 0 -3"/>{limit}<mimic joint="k"/>', 'revolute')
    assert (joint.name, joint.kind, joint.parent, joint.child, joint.is_mimic) == ('j', 'revolute', 'a', 'b', True)
    assert (joint.effort, joint.speed, joint.axis.tolist()) == (2.5, 10, [0, 0, -1])
    assert joint.child_in_parent[:3, [0, 3]] == pytest.approx(np.array([[0, 1], [1, 2], [0, 3]]))
    for given, kind in (('', 'continuous'), ('<axis xyz="0 0 0"/>', 'fixed'), ('<limit effort="inf"/>', 'continuous')):
        joint = joint_of(ENDS + given, kind)
        assert (joint.effort, joint.speed, joint.is_mimic, joint.axis.tolist()) == (None, None, False, [1, 0, 0])


@pytest.mark.parametrize(
    ('body', 'complaint'),
    [
        ('', 'the robot has no link'),
        ('<link/>', '<link>: name: missing'),
        ('<link name="a"/><link name="a"/>', "link 'a': given 2 times"),
        ('<robot>', 'not well-formed'),
        (LINKS + JOINTS + joint('axle', 'base', 'wheel'), "joint 'axle': given 2 times"),
        (LINKS + joint('a', 'bass', 'wheel'), "joint 'a': parent: no link is named 'bass'; did you mean 'base'?"),
        (LINKS + joint('a', 'base', 'x'), "joint 'a': child: no link is named 'x'"),
        (LINKS + JOINTS + joint('a', 'wheel', 'laser'), "'laser' is the child of two joints, 'mount' and 'a'"),
        (LINKS + joint('a', 'base', 'wheel'), "2 links hang on no joint: 'base', 'laser'"),
        (LINKS + JOINTS + joint('c', 'laser', 'base'), "the links 'base', 'wheel', 'laser' form a loop"),
        (LINKS + joint('b', 'wheel', 'laser') + joint('c', 'laser', 'wheel'), "'wheel', 'laser' form a loop"),
        (in_link('<inertial><mass value="-1"/></inertial>'), "link 'l': mass value: given '-1'"),
        (in_link('<inertial><mass/></inertial>'), 'mass value: given None'),
        (in_link('<inertial><mass value="1"/><inertia ixx="a"/></inertial>'), "inertia ixx: given 'a'"),
        (in_link('<inertial><mass value="1"/><origin xyz="0 0"/></inertial>'), "inertial: origin xyz: given '0 0'"),
        (in_link(collision('<box size="1 1"/>')), "link 'l': collision: box size: given '1 1'"),
        (in_link(collision('<mesh/>')), 'mesh: filename: missing'),
        (with_joint(ENDS, 'Fixed'), "joint 'j': type: given 'Fixed'; allowed: fixed, continuous, revolute"),
        (with_joint('<child link="b"/>'), "joint 'j': parent: no link is named ''"),
        (with_joint(f'{ENDS}<axis xyz="0 0 0"/>'), "joint 'j': axis xyz: given '0 0 0'"),
        (with_joint(f'{ENDS}<limit velocity="fast"/>'), "limit velocity: given 'fast'"),
    ],
)
def test_what_is_no_robot_or_a_bad_number_is_named_in_one_line(body, complaint):
    with pytest.raises(ConfigError) as caught:
        parse(body)
    line = str(caught.value)
    assert complaint in line and '\n' not in line and line.startswith('r.urdf')


ROBOT = '<robot name="Gr\u00fcn"><link name="a"/></robot>'


def read(folder, content):
    path = folder / 'robot.urdf'
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return parse_urdf(read_robot_text(path), str(path))


@pytest.mark.parametrize(
    'content',
    [
        f'\n\n <?xml version="1.0"?>\n{ROBOT}',
        b'\xef\xbb\xbf<?xml version="1.0"?>' + ROBOT.encode(),
        f'<?xml version="1.0" encoding="ISO-8859-1"?><!-- \u00fc -->{ROBOT}'.encode('latin-1'),
        f'<!-- \u00fc -->{ROBOT}'.encode('latin-1'),
        f'<!DOCTYPE robot SYSTEM "http://nowhere.invalid/robot.dtd">{ROBOT}',
        ROBOT.replace('/>', ' xmlns="http://www.ros.org" xmlns:x="http://x" x:b="1"/>'),
        ROBOT.replace('</robot>', '<gazebo><sensor:ray name="undeclared"/></gazebo></robot>'),
        ROBOT.replace('</robot>', f'<material name="m"/><link name="b"/>{joint("b", "a", "b")}</robot>'),
    ],
)
def test_a_form_that_does_no_harm_is_read(tmp_path, content):
    tree = read(tmp_path, content)
    assert (tree.name, tree.root) == ('Gr\u00fcn', 'a')


@pytest.mark.parametrize(
    ('content', 'text'),
    [
        ('', 'line 1: not well-formed XML: no element found'),
        ('<sdf version="1.6"/>', 'given <sdf>; allowed: a URDF or xacro file'),
        (b'\x89PNG\r\n\x1a\n\0\0\0', 'not well-formed'),
        ('\n\n<?xml version="1.0"\n?><robot>\n<link></robot>', 'line 3: not well-formed XML: mismatched tag'),
    ],
)
def test_what_is_no_xml_is_refused_at_its_line(tmp_path, content, text):
    with pytest.raises(ConfigError, match=f'^{tmp_path}/robot.urdf[,:] [^\n]*{text}[^\n]*$'):
        read(tmp_path, content)
