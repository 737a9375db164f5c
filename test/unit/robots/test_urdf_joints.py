"""A URDF's <joint>."""

from xml.etree import ElementTree

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.urdf_reading import parse_joint

ENDS = '<parent link="a"/><child link="b"/>'


def parse(body, kind='continuous'):
    return parse_joint(ElementTree.fromstring(f'<joint name="j" type="{kind}">{body}</joint>'), 'r.urdf')


def test_a_joint_has_all_that_is_given():
    limit, origin = '<limit effort="2.5" velocity="10"/>', '<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/>'
    joint = parse(f'{ENDS}{origin}<axis xyz="0 0 -3"/>{limit}<mimic joint="k"/>', 'revolute')
    assert (joint.name, joint.kind, joint.parent, joint.child, joint.is_mimic) == ('j', 'revolute', 'a', 'b', True)
    assert (joint.effort, joint.speed) == (2.5, 10)
    assert joint.axis == pytest.approx([0, 0, -1])
    assert joint.child_in_parent[:3, 3] == pytest.approx([1, 2, 3])
    assert joint.child_in_parent[:3, 0] == pytest.approx([0, 1, 0])


def test_what_is_not_given_is_as_urdf_says():
    joint = parse(ENDS)
    assert joint.axis == pytest.approx([1, 0, 0])
    assert (joint.effort, joint.speed, joint.is_mimic) == (None, None, False)
    assert parse(f'{ENDS}<limit effort="inf" velocity="1e300"/>').effort is None


def test_an_axis_that_turns_nothing_may_be_zero():
    assert parse(f'{ENDS}<axis xyz="0 0 0"/>', 'fixed').axis == pytest.approx([1, 0, 0])


@pytest.mark.parametrize(
    ('body', 'kind', 'complaint'),
    [
        (ENDS, 'Fixed', "joint 'j': type: given 'Fixed'; allowed: fixed, continuous, revolute"),
        (ENDS, '', "joint 'j': type: given ''"),
        ('<child link="b"/>', 'fixed', "joint 'j': parent: missing"),
        ('<parent link="a"/><child/>', 'fixed', "joint 'j': child: missing"),
        ('<parent link="a"/><child link="a"/>', 'fixed', "given 'a' as parent and child"),
        (f'{ENDS}<axis xyz="0 0 0"/>', 'continuous', "axis xyz: given '0 0 0'; allowed: a direction, not zero"),
        (f'{ENDS}<axis xyz="0 nan 0"/>', 'continuous', "axis xyz: given '0 nan 0'"),
        (f'{ENDS}<axis xyz="0 1"/>', 'continuous', "axis xyz: given '0 1'; allowed: 3 finite number(s)"),
        (f'{ENDS}<origin xyz="0 0 inf"/>', 'fixed', "origin xyz: given '0 0 inf'"),
        (f'{ENDS}<origin xyz="0 0 1e300"/>', 'fixed', "origin xyz: given '0 0 1e300'; allowed: from -1e+06 to 1e+06"),
        (f'{ENDS}<origin rpy="0 0"/>', 'fixed', "origin rpy: given '0 0'"),
        (f'{ENDS}<limit effort="-1"/>', 'continuous', "limit effort: given '-1'; allowed: a number, not negative"),
        (f'{ENDS}<limit velocity="fast"/>', 'continuous', "limit velocity: given 'fast'"),
    ],
)
def test_a_bad_joint_is_named(body, kind, complaint):
    with pytest.raises(ConfigError) as caught:
        parse(body, kind)
    assert str(caught.value).startswith("r.urdf: joint 'j': ")
    assert complaint in str(caught.value)


def test_a_joint_needs_a_name():
    with pytest.raises(ConfigError, match='r.urdf: <joint>: name: missing'):
        parse_joint(ElementTree.fromstring('<joint type="fixed"/>'), 'r.urdf')
