"""URDF text becomes a tree, or one line that names file and element."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.urdf_reading import MOST_LINKS, parse_urdf

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
    assert tree.link_poses()['laser'][:3, 3] == pytest.approx([0.1, 0, 0.2])
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


def test_a_long_chain_of_links_is_read():
    names = [f'l{number}' for number in range(MOST_LINKS)]
    body = ''.join(f'<link name="{name}"/>' for name in names)
    tree = parse(body + ''.join(joint(f'{a}_{b}', a, b) for a, b in zip(names, names[1:])))
    assert list(tree.subtree('l0')) == names == list(tree.link_poses())


@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        ('<sdf version="1.6"/>', 'given an SDF file (of Gazebo); allowed: a URDF or xacro file'),
        ('<mujoco/>', 'given an MJCF file'),
        ('<launch/>', 'given a launch file'),
        ('<html/>', 'given <html>'),
        ('<robot/>', 'the robot has no link'),
        (
            '<robot><include filename="a.xacro"/></robot>',
            '<include>: given in a URDF; allowed: in a xacro, as <xacro:include>',
        ),
        ('<robot><macro name="m"/></robot>', 'as <xacro:macro>'),
        ('<robot><link/></robot>', '<link>: name: missing'),
        ('<robot><link name=" "/></robot>', '<link>: name: missing'),
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
        (LINKS + joint('a', 'base', 'base'), "joint 'a': given 'base' as parent and child"),
        (LINKS + JOINTS + joint('a', 'wheel', 'laser'), "'laser' is the child of two joints, 'mount' and 'a'"),
        (LINKS + joint('a', 'base', 'wheel'), "2 links hang on no joint: 'base', 'laser'"),
        (
            LINKS + joint('a', 'base', 'wheel') + joint('b', 'wheel', 'laser') + joint('c', 'laser', 'base'),
            "the links 'base', 'laser', 'wheel', 'base' form a loop",
        ),
        (LINKS + joint('b', 'wheel', 'laser') + joint('c', 'laser', 'wheel'), "'wheel', 'laser', 'wheel' form a loop"),
        (''.join(f'<link name="l{number}"/>' for number in range(30)), "'l9' and 20 more"),
        (''.join(f'<link name="l{number}"/>' for number in range(MOST_LINKS + 1)), 'given 1001 links'),
    ],
)
def test_what_is_no_tree_is_refused(body, complaint):
    assert complaint in refused(f'<robot name="r">{body}</robot>')


def test_what_is_ignored_is_noted():
    tree = parse('<link name="a"><collision/><inertial><mass value="0"/></inertial></link>')
    assert tree.links['a'].inertial is None and tree.links['a'].collisions == ()
    assert len(tree.notes) == 2 and all("link 'a'" in note for note in tree.notes)
    assert np.allclose(tree.link_poses()['a'], np.eye(4))


@pytest.mark.parametrize('element', ['robot', 'link', 'joint'])
def test_a_name_that_pybullet_has_no_room_for_is_refused(element):
    name = '\u00fc' * 200
    parts = {each: name if each == element else 'a' for each in ('robot', 'link', 'joint')}
    joint = f'<joint name="{parts["joint"]}" type="fixed"><parent link="{parts["link"]}"/><child link="b"/></joint>'
    text = f'<robot name="{parts["robot"]}"><link name="{parts["link"]}"/><link name="b"/>{joint}</robot>'
    with pytest.raises(ConfigError, match=f'my.urdf: <{element}>: name: given .*; allowed: at most 255 bytes'):
        parse_urdf(text, 'my.urdf')
