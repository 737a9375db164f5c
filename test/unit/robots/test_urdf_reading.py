"""URDF text becomes a tree, or one line that names file and element."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.solids import Box, Cylinder, Mesh, Sphere
from diff_encoder_sim.robots.urdf_reading import parse_robot_xml, parse_urdf, read_robot_text

LINKS = '<link name="base"/><link name="wheel"/><link name="laser"/>'
JOINTS = (
    '<joint name="axle" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 2 0"/></joint>'
    '<joint name="mount" type="fixed"><parent link="base"/><child link="laser"/><origin xyz="0.1 0 0.2"/></joint>'
)


def parse(body):
    return parse_urdf(f'<robot name="r">{body}</robot>', 'r.urdf')


def refused(text):
    with pytest.raises(ConfigError) as caught:
        parse_urdf(text, 'r.urdf')
    line = str(caught.value)
    assert '\n' not in line and line.startswith('r.urdf')
    return line


def joint(name, parent, child):
    return f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'


def test_a_tree_of_links_is_read():
    tree = parse(LINKS + JOINTS)
    assert (tree.name, tree.root, list(tree.links), list(tree.joints)) == (
        'r',
        'base',
        ['base', 'wheel', 'laser'],
        ['axle', 'mount'],
    )
    assert tree.poses['laser'][:3, 3] == pytest.approx([0.1, 0, 0.2])
    assert tree.joints['axle'].axis == pytest.approx([0, 1, 0])
    assert list(tree.subtree('base')) == ['base', 'wheel', 'laser']


def test_namespaces_and_unknown_tags_do_not_matter():
    text = (
        '<robot xmlns="http://x" xmlns:y="http://y"><y:thing/><material name="m"/><link name="a"><what/></link></robot>'
    )
    tree = parse_urdf(text, 'r.urdf')
    assert (tree.name, tree.root) == ('robot', 'a')


def test_a_link_and_a_joint_may_have_the_same_name():
    assert 'wheel' in parse('<link name="base"/><link name="wheel"/>' + joint('wheel', 'base', 'wheel')).joints


@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        ('<sdf version="1.6"/>', 'given <sdf>; allowed: a URDF or xacro file'),
        ('<robot/>', 'the robot has no link'),
        ('<robot><link/></robot>', '<link>: name: missing'),
        ('<robot><link name="a"/><link name="a"/></robot>', "link 'a': given 2 times"),
        ('<robot>', 'not well-formed'),
    ],
)
def test_what_is_no_robot_is_refused(text, complaint):
    assert complaint in refused(text)


@pytest.mark.parametrize(
    ('body', 'complaint'),
    [
        (LINKS + JOINTS + joint('axle', 'base', 'wheel'), "joint 'axle': given 2 times"),
        (LINKS + joint('a', 'bass', 'wheel'), "joint 'a': parent: no link is named 'bass'; did you mean 'base'?"),
        (LINKS + joint('a', 'base', 'x'), "joint 'a': child: no link is named 'x'"),
        (LINKS + JOINTS + joint('a', 'wheel', 'laser'), "'laser' is the child of two joints, 'mount' and 'a'"),
        (LINKS + joint('a', 'base', 'wheel'), "2 links hang on no joint: 'base', 'laser'"),
        (
            LINKS + joint('a', 'base', 'wheel') + joint('b', 'wheel', 'laser') + joint('c', 'laser', 'base'),
            "the links 'base', 'wheel', 'laser' form a loop",
        ),
        (LINKS + joint('b', 'wheel', 'laser') + joint('c', 'laser', 'wheel'), "'wheel', 'laser' form a loop"),
        (''.join(f'<link name="l{number}"/>' for number in range(30)), "'l9' and 20 more"),
    ],
)
def test_what_is_no_tree_is_refused(body, complaint):
    assert complaint in refused(f'<robot name="r">{body}</robot>')


def test_what_is_ignored_is_noted():
    tree = parse('<link name="a"><collision/><inertial><mass value="0"/></inertial></link>')
    assert tree.links['a'].inertial is None and tree.links['a'].collisions == ()
    assert len(tree.notes) == 2 and all("link 'a'" in note for note in tree.notes)
    assert np.allclose(tree.poses['a'], np.eye(4))


def parse_urdf_links(body, notes=None):
    tree = parse(f'<link name="l">{body}</link>')
    if notes is not None:
        notes += tree.notes
    return tree.links['l']


def collision(geometry, inside=''):
    return f'<collision>{inside}<geometry>{geometry}</geometry></collision>'


def test_the_inertia_is_turned_into_the_links_axes():
    inertial = parse_urdf_links(
        '<inertial><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>'
        '<inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0.2" iyz="0.3"/></inertial>'
    ).inertial
    assert (inertial.mass_kg, list(inertial.com_m)) == (2, [1, 0, 0])
    expected = np.array([[2, -0.1, -0.3], [-0.1, 1, 0.2], [-0.3, 0.2, 2.5]])
    assert inertial.inertia_kgm2 == pytest.approx(expected)


def test_a_link_without_inertial_has_no_mass():
    assert parse_urdf_links('').inertial is None
    assert parse_urdf_links('<inertial/>').inertial is None


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
    (shape,) = parse_urdf_links(collision(geometry, '<origin xyz="0 0 0.1"/>')).collisions
    assert shape.geometry == expected
    assert list(shape.pose_in_link[:3, 3]) == [0, 0, 0.1]


@pytest.mark.parametrize('geometry', ['', '<plane/>', '<box size="0 0 0"/>', '<sphere radius="0"/>'])
def test_a_collision_that_nothing_can_hit_is_ignored_and_noted(geometry):
    notes = []
    assert parse_urdf_links(collision(geometry), notes).collisions == ()
    assert notes == ["link 'l': a <collision> without a shape or of size zero is ignored"]


def test_a_bad_visual_does_not_matter():
    good, bad = (
        '<visual><geometry><box size="1 1 1"/></geometry></visual>',
        '<visual><geometry><box/></geometry></visual>',
    )
    link = parse_urdf_links(bad + good + '<visual/>')
    assert [shape.geometry for shape in link.visuals] == [Box((1, 1, 1))]


def test_friction_is_that_of_pybullets_tag():
    assert parse_urdf_links('<contact><lateral_friction value="0.25"/></contact>').friction == 0.25
    assert parse_urdf_links('<contact/>').friction is None


@pytest.mark.parametrize(
    ('body', 'complaint'),
    [
        ('<inertial><mass value="-1"/></inertial>', "mass value: given '-1'; allowed: not negative"),
        ('<inertial><mass value="nan"/></inertial>', "mass value: given 'nan'"),
        ('<inertial><mass/></inertial>', 'mass value: given None'),
        ('<inertial><mass value="1"/><inertia ixx="a"/></inertial>', "inertia ixx: given 'a'"),
        ('<inertial><mass value="1"/><origin xyz="0 0"/></inertial>', "inertial: origin xyz: given '0 0'"),
        (collision('<box size="1 -1 1"/>'), "collision: box size: given '1 -1 1'; allowed: lengths greater than 0 [m]"),
        (collision('<box size="1 1"/>'), "box size: given '1 1'; allowed: 3"),
        (collision('<cylinder radius="1"/>'), 'cylinder length: given None'),
        (collision('<sphere radius="-1"/>'), "sphere radius: given '-1'"),
        (collision('<mesh/>'), 'mesh: filename: missing'),
        (collision('<mesh filename="a" scale="1 0 1"/>'), 'allowed: not zero'),
    ],
)
def test_a_bad_number_is_named(body, complaint):
    with pytest.raises(ConfigError) as caught:
        parse_urdf_links(body)
    assert str(caught.value).startswith("r.urdf: link 'l': ") and complaint in str(caught.value)


ENDS = '<parent link="a"/><child link="b"/>'


def parse_urdf_joints(body, kind='continuous'):
    return parse(f'<link name="a"/><link name="b"/><joint name="j" type="{kind}">{body}</joint>').joints['j']


def test_a_joint_has_all_that_is_given():
    limit, origin = '<limit effort="2.5" velocity="10"/>', '<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>'
    joint = parse_urdf_joints(f'{ENDS}{origin}<axis xyz="0 0 -3"/>{limit}<mimic joint="k"/>', 'revolute')
    assert (joint.name, joint.kind, joint.parent, joint.child, joint.is_mimic) == ('j', 'revolute', 'a', 'b', True)
    assert (joint.effort, joint.speed) == (2.5, 10)
    assert joint.axis == pytest.approx([0, 0, -1])
    assert joint.child_in_parent[:3, 3] == pytest.approx([1, 2, 3])
    assert joint.child_in_parent[:3, 0] == pytest.approx([0, 1, 0])


def test_what_is_not_given_is_as_urdf_says():
    joint = parse_urdf_joints(ENDS)
    assert joint.axis == pytest.approx([1, 0, 0])
    assert (joint.effort, joint.speed, joint.is_mimic) == (None, None, False)
    assert parse_urdf_joints(f'{ENDS}<limit effort="inf" velocity="1e300"/>').effort is None


def test_an_axis_that_turns_nothing_may_be_zero():
    assert parse_urdf_joints(f'{ENDS}<axis xyz="0 0 0"/>', 'fixed').axis == pytest.approx([1, 0, 0])


@pytest.mark.parametrize(
    ('body', 'kind', 'complaint'),
    [
        (ENDS, 'Fixed', "joint 'j': type: given 'Fixed'; allowed: fixed, continuous, revolute"),
        ('<child link="b"/>', 'fixed', "joint 'j': parent: missing"),
        (f'{ENDS}<axis xyz="0 0 0"/>', 'continuous', "axis xyz: given '0 0 0'; allowed: a direction, not zero"),
        (f'{ENDS}<axis xyz="0 1"/>', 'continuous', "axis xyz: given '0 1'; allowed: 3 finite number(s)"),
        (f'{ENDS}<origin xyz="0 0 inf"/>', 'fixed', "origin xyz: given '0 0 inf'"),
        (f'{ENDS}<origin rpy="0 0"/>', 'fixed', "origin rpy: given '0 0'"),
        (f'{ENDS}<limit effort="-1"/>', 'continuous', "limit effort: given '-1'; allowed: a number, not negative"),
        (f'{ENDS}<limit velocity="fast"/>', 'continuous', "limit velocity: given 'fast'"),
    ],
)
def test_a_bad_joint_is_named(body, kind, complaint):
    with pytest.raises(ConfigError) as caught:
        parse_urdf_joints(body, kind)
    assert str(caught.value).startswith("r.urdf: joint 'j': ")
    assert complaint in str(caught.value)


ROBOT = '<robot name="r"><link name="a"/></robot>'


def read(folder, content):
    path = folder / 'robot.urdf'
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return parse_robot_xml(read_robot_text(path), str(path))


def refused_robot_xml(folder, content):
    with pytest.raises(ConfigError) as caught:
        read(folder, content)
    text = str(caught.value)
    assert '\n' not in text and text.startswith(str(folder))
    return text


@pytest.mark.parametrize(
    'content',
    [
        f'\n\n <?xml version="1.0"?>\n{ROBOT}',
        b'\xef\xbb\xbf<?xml version="1.0"?>' + ROBOT.encode(),
        f'<?xml version="1.0" encoding="ISO-8859-1"?><!-- \u00fc -->{ROBOT}'.encode('latin-1'),
        f'<!-- \u00fc -->{ROBOT}'.encode('latin-1'),
        f'<!DOCTYPE robot SYSTEM "http://nowhere.invalid/robot.dtd">{ROBOT}',
        '<robot name="r" xmlns="http://www.ros.org" xmlns:x="http://x"><link name="a" x:b="1"/></robot>',
        '<robot name="r"><link name="a"/><gazebo><sensor:ray name="undeclared"/></gazebo></robot>',
    ],
)
def test_a_form_that_does_no_harm_is_read(tmp_path, content):
    robot = read(tmp_path, content)
    assert (robot.tag, robot.get('name'), robot.find('link').get('name')) == ('robot', 'r', 'a')


def test_lines_are_those_of_the_file(tmp_path):
    assert 'robot.urdf, line 5: not well-formed XML: mismatched tag' in refused_robot_xml(
        tmp_path, '\n\n<?xml version="1.0"\n?><robot>\n<link></robot>'
    )


@pytest.mark.parametrize(
    ('content', 'text'),
    [
        ('', 'no element found'),
        ('hello', 'line 1: not well-formed XML: syntax error'),
        (b'\x89PNG\r\n\x1a\n\0\0\0', 'not well-formed'),
    ],
    ids=lambda value: value[:20] if isinstance(value, str) else '',
)
def test_what_could_do_harm_is_refused(tmp_path, content, text):
    assert text in refused_robot_xml(tmp_path, content)


def test_an_encoding_that_is_declared_is_used(tmp_path):
    name = '<?xml version="1.0" encoding="iso-8859-1"?><robot name="Gr\u00fcn"/>'.encode('latin-1')
    assert read(tmp_path, name).get('name') == 'Gr\u00fcn'
