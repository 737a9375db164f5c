"""Whatever is in a robot's file: a tree or one line, and nothing else."""

import random
import re

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.robots.xacro_process import Expander
from places import ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
VALUES = ['', ' ', 'nan', '-inf', '1e400', '-1', '0', '0 0 0', '1 2', '0x1', '\u0663', 'base_link', 'laser', '&amp;']
XACRO_VALUES = [
    *VALUES,
    '${',
    '${}',
    '${x}',
    '$(arg)',
    '$(arg x)',
    '$(find x)',
    '$(env)',
    '$(',
    '$${',
    '${[][0]}',
    '${pi}',
]
TAGS = ['robot', 'link', 'joint', 'origin', 'mass', 'collision', 'geometry', 'box', 'parent', 'gazebo', 'mimic']
XACRO_TAGS = [*TAGS, 'xacro:if', 'xacro:macro', 'xacro:property', 'xacro:include', 'xacro:arg', 'xacro:insert_block']

XACRO = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="size" default="1"/><xacro:property name="w" value="${0.1 * 2}"/>
  <xacro:macro name="wheel" params="name *place side:=1"><link name="${name}">
    <collision><geometry><sphere radius="${w / 2}"/></geometry></collision></link>
    <joint name="${name}_joint" type="continuous"><parent link="base"/><child link="${name}"/>
      <xacro:insert_block name="place"/></joint></xacro:macro>
  <link name="base"/><xacro:if value="$(arg size)"><gazebo/></xacro:if>
  <xacro:wheel name="left"><origin xyz="0 ${w} 0"/></xacro:wheel>
  <xacro:wheel name="right" side="-1"><origin xyz="0 ${-w} 0"/></xacro:wheel>
</robot>"""


def mutated(text, rng, values, tags):
    """The text with one or two values, tags or characters changed."""
    for _ in range(rng.randint(1, 2)):
        kind = rng.randrange(5)
        if kind <= 1:
            text = replaced(text, rng, r'(?<=")[^"]*(?=")', rng.choice(values))
        elif kind == 2:
            text = replaced(text, rng, r'(?<=[</])[\w:]+', rng.choice(tags))
        elif kind == 3:
            text = replaced(text, rng, r'<[^<>]*/>', rng.choice(['', '<a/>', text[: rng.randrange(300)]]))
        else:
            at = rng.randrange(len(text))
            text = text[:at] + rng.choice(['', '<', '>', '"', '&', '\0', '\ud7ff', text[at : at + 40]]) + text[at + 1 :]
    return text


def replaced(text, rng, pattern, by):
    places = list(re.finditer(pattern, text))
    if not places:
        return text
    place = rng.choice(places)
    return text[: place.start()] + by + text[place.end() :]


def outcome(text):
    """What becomes of a URDF: a tree or None."""
    try:
        tree = parse_urdf(text, 'r.urdf')
    except ConfigError as error:
        assert str(error).startswith('r.urdf') and '\n' not in str(error)
        return None
    assert isinstance(tree, RobotTree)
    assert set(tree.link_poses()) == set(tree.links) == set(tree.subtree(tree.root))
    return tree


def test_any_urdf_is_a_tree_or_one_line():
    rng, alto = random.Random(1), expand(RobotSource(ALTO))
    outcomes = [outcome(mutated(alto, rng, VALUES, TAGS)) for _ in range(150)]
    assert 5 < sum(tree is not None for tree in outcomes) < 145


@pytest.mark.parametrize('seed', [1, 2])
def test_any_xacro_is_a_tree_or_one_line(tmp_path, seed):
    rng, path = random.Random(seed), tmp_path / 'r.xacro'
    trees = 0
    for _ in range(100):
        path.write_text(mutated(XACRO, rng, XACRO_VALUES, XACRO_TAGS), encoding='utf-8', errors='replace')
        answer = Expander(RobotSource(path)).answer()
        if 'urdf' in answer:
            trees += outcome(answer['urdf']) is not None
        else:
            assert answer['fault'].startswith(str(path)) and '\n' not in answer['fault']
    assert trees > 5
