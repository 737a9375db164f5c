"""Tests as users write them and as the paper's are; a trial: its goal and outcome, its wheels, its text in a bag."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.drives.trial_definition import GOAL_DISTANCE_M, Trial, goal_error, wheels_of
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from places import ROOT

TEST = TestDefinition.from_mapping(
    {'name': 'T', 'world': 'w', 'drive': [{'straight': 2.0}], 'route': [{'goal': {'x': 1.0, 'yaw': 0.5}}]}, ''
)


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
        ('world: b', 'a path, a route, or both'),
        ('world: b, path: []', 'a path, a route, or both'),
        ('world: b, route: [{turns: 1}]', 'whose last leg is a goal'),
        ('world: b, route: [{through: []}]', 'route.0.through: given'),
        ('world: b, route: [{goal: {x: 1.0}, turns: 2}]', 'one of goal, through, turns'),
        ('world: b, path: [{straight: 1, turns: 1}]', 'path.0: given .*one of straight, turns, arc, pivot, stop'),
        ('world: b, path: [{}]', 'one of straight, turns'),
        ('world: b, drive: [{straight: .nan}]', 'drive.0.straight: given nan'),
        ('world: b, path: [{arc: {radius: 1}}]', 'path.0.arc.turns: missing'),
        ('world: b, path: [{pivot: {wheel: rear, turns: 1}}]', "path.0.pivot.wheel: given 'rear'; allowed: 'left' or"),
        ('world: b, drive: [{straight: 1}], start: {x: far}', "start.x: given 'far'"),
        ('world: b, drive: [{straight: 1}], limits: {speed: 0}', 'limits.speed: given 0'),
        (
            'world: b, path: [{straight: 1}], floor: [{x_min: 0, x_max: 1, y_min: 1, y_max: 0, mu: 1}]',
            'floor.0.y_max: given 0.*at least y_min, 1',
        ),
        ('world: b, route: [{goal: {x: 1.0e+7}}]', 'route.0.goal.x: given 10000000.0; allowed: -1e6 to 1e6'),
        ('world: b, route: [{through: [{x: 0, y: -.inf}]}, {goal: {}}]', 'route.0.through.0.y: given -inf'),
        ('wrold: b, drive: [{straight: 1}]', "unknown key; did you mean 'world'|world: miss"),
    ],
)
def test_a_bad_test_file_is_named_with_its_key(tmp_path, content, complaint):
    path = tmp_path / 'bad.yaml'
    path.write_text(f'{{name: a, {content}}}')
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_test(str(path), ROOT / 'config')
    assert str(caught.value).startswith(f'{path}: ')


def test_a_path_ends_where_its_segments_lead():
    segments = [{'arc': {'radius': 2.0, 'turns': 0.25}}, {'stop': 3.0}, {'arc': {'radius': -1.0, 'turns': -0.5}}]
    test = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'path': segments}, '')
    # Ahead around (0, 2) to (2, 2); back around (1, 2), on the left of the heading.
    assert test.goal() == pytest.approx((0.0, 2.0, -0.5 * math.pi))


def test_drive_is_the_older_name_of_path_also_in_bags():
    older = {'name': 'T', 'world': 'w', 'drive': [{'straight': 1.0, 'turns': None}]}
    test = TestDefinition.from_mapping(older, '')
    assert test == TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'path': [{'straight': 1.0}]}, '')
    assert test.model_dump()['drive'] == older['drive']


def test_an_unknown_world_is_named():
    with pytest.raises(ConfigError, match="world: given 'moon'; allowed: hallway, open_floor, ros_logo"):
        find_world('moon', ROOT / 'worlds')


def test_a_scripted_trial_ends_with_its_drive_and_any_other_at_the_goal_of_its_route():
    assert Trial(test=TEST, nav='scripted').goal() == (2.0, 0.0, 0.0)
    assert Trial(test=TEST, nav='embedded').goal() == (1.0, 0.0, 0.5)


def test_usual_values_are_left_out_of_a_bag():
    usual = Trial(test=TEST).model_dump()
    assert {'encoder', 'resolution', 'variant', 'axle_x', 'counter_modulus'}.isdisjoint(usual)
    real = Trial(test=TEST, ppr=PerWheel(left=8192, right=8192), encoder='amt102', resolution='2048 lines x 4')
    assert real.encoder_label == '8192 amt102' and Trial(test=TEST).encoder_label == '90'
    assert Trial.from_mapping(real.model_dump(), '') == real


@pytest.mark.parametrize('yaw_rad', [0.0, 3.0])
def test_a_robot_within_the_distance_is_at_its_goal_whatever_its_heading(yaw_rad):
    assert goal_error(Pose2D(1.0 + GOAL_DISTANCE_M, 2.0, yaw_rad), Pose2D(1.0, 2.0, 0.0)) is None
    assert '0.51 m from the goal' in goal_error(Pose2D(1.51, 2.0, yaw_rad), Pose2D(1.0, 2.0, 0.0))


def test_the_parameters_of_odometry_are_kept():
    of_odometry = OdometryParams(wheel_diameter=0.07, axle_x=0.1)
    of_encoder = EncoderParams(left_joint='l', left_reversed=True, counter_modulus=4096)
    trial = Trial(test=TEST, **wheels_of(of_odometry, of_encoder))
    again = Trial.model_validate_json(trial.model_dump_json())
    assert again == trial
    assert (again.wheel_diameter.plain, again.wheel_separation, again.axle_x) == (0.07, 0.4, 0.1)
    joints = again.left_joint, again.right_joint, again.left_reversed, again.right_reversed
    assert (*joints, again.counter_modulus) == ('l', 'right_wheel_joint', True, False, 4096)
