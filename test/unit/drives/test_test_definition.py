"""Tests as users write them, and the ones that are the paper's."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import find_world, load_test
from places import ROOT


def test_the_tests_are_the_papers():
    line, turns, long = (load_test(name, ROOT / 'config') for name in ('SL', 'SMT', 'DLD'))
    for test in (line, turns, long):
        world = find_world(test.world, ROOT / 'worlds')
        assert world.is_absolute() and world.suffix == '.world'
    assert line.goal().relative_to(line.start.pose()) == pytest.approx((20.0, 0.0, 0.0))
    assert (line.limits.speed, line.limits.acceleration) == (0.45, 0.7)
    assert [segment.turns for segment in turns.drive] == [5] and turns.goal() == pytest.approx(turns.start.pose())
    through = [(point.x, point.y) for leg in long.route for point in leg.through or []]
    points = [long.start.pose()[:2], *through, long.goal()[:2]]
    assert sum(math.dist(a, b) for a, b in zip(points, points[1:])) == pytest.approx(95, abs=2)


@pytest.mark.parametrize(
    ('content', 'complaint'),
    [
        ('name: a\nworld: b\n', 'a drive, a route, or both'),
        ('name: a\nworld: b\ndrive: []\n', 'a drive, a route, or both'),
        ('name: a\nworld: b\nroute: [{turns: 1}]\n', 'whose last leg is a goal'),
        ('name: a\nworld: b\nroute: [{through: []}]\n', 'route.0.through: given'),
        ('name: a\nworld: b\nroute: [{goal: {x: 1.0}, turns: 2}]\n', 'one of goal, through, turns'),
        ('name: a\nworld: b\ndrive: [{straight: 1, turns: 1}]\n', 'drive.0: given .*either straight or'),
        ('name: a\nworld: b\ndrive: [{}]\n', 'either straight or turns'),
        ('name: a\nworld: b\ndrive: [{straight: .nan}]\n', 'drive.0.straight: given nan'),
        ('name: a\nworld: b\ndrive: [{straight: 1}]\nstart: {x: far}\n', "start.x: given 'far'"),
        ('name: a\nworld: b\ndrive: [{straight: 1}]\nlimits: {speed: 0}\n', 'limits.speed: given 0'),
        ('name: a\nworld: b\nroute: [{goal: {x: 1.0e+7}}]\n', 'route.0.goal.x: given 10000000.0; allowed: -1e6 to 1e6'),
        ('name: a\nworld: b\nroute: [{through: [{x: 0, y: -.inf}]}, {goal: {}}]\n', 'route.0.through.0.y: given -inf'),
        ('name: a\nwrold: b\ndrive: [{straight: 1}]\n', "unknown key; did you mean 'world'|world: miss"),
    ],
)
def test_a_bad_test_file_is_named_with_its_key(tmp_path, content, complaint):
    path = tmp_path / 'bad.yaml'
    path.write_text(content)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_test(str(path), ROOT / 'config')
    assert str(caught.value).startswith(f'{path}: ')


def test_an_unknown_world_is_named():
    with pytest.raises(ConfigError, match="world: given 'moon'; allowed: hallway, ros_logo"):
        find_world('moon', ROOT / 'worlds')
