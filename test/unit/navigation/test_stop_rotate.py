"""The end of a drive and the way out of trouble, step by step."""

import math

import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.navigation.costmap import LETHAL, Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.navigator_params import CLEAR_COSTMAP, ROTATE, NavigatorParams
from diff_encoder_sim.navigation.recovery import ClearCostmap, RecoveryView, Rotate, recoveries
from diff_encoder_sim.navigation.stop_rotate import LatchedStopRotate, Motion
from navigation_simulation import TABLE_2, rasterise, shapes_of

GOAL = Pose2D(0.0, 0.0, 1.0)


def dwa_params(**changes):
    return DwaParams.from_mapping({**TABLE_2, **changes}, '')


def controller(**changes):
    return LatchedStopRotate(dwa_params(**changes), 0.05)


def always(*_):
    return True


def test_position_is_reached_within_tolerance_and_then_latched():
    latched, free = controller(), controller(latch_xy_goal_tolerance=False)
    for at, expected in ((0.06, (False, False)), (0.05, (True, True)), (0.07, (True, False))):
        motion = Motion(Pose2D(at, 0.0, 0.0), 0.0, 0.0)
        assert (latched.is_position_reached(motion, GOAL), free.is_position_reached(motion, GOAL)) == expected
    latched.reset()
    assert not latched.is_position_reached(Motion(Pose2D(0.07, 0.0, 0.0), 0.0, 0.0), GOAL)


def test_goal_is_reached_only_when_it_stands_and_looks_there():
    for yaw, linear, angular, expected in (
        (1.05, 0.0, 0.0, True),
        (1.06, 0.0, 0.0, False),
        (1.0, 0.11, 0.0, False),
        (1.0, 0.0, 0.11, False),
        (1.0 - 2 * math.pi, 0.0, 0.0, True),
    ):
        motion = Motion(Pose2D(0.03, 0.0, yaw), linear, angular)
        assert controller().is_goal_reached(motion, GOAL) is expected


def test_it_brakes_then_turns_then_stops():
    stop = controller()
    assert stop.command(Motion(IDENTITY, 0.3, -0.5), GOAL, always) == pytest.approx((0.265, -0.255))
    assert stop.command(Motion(IDENTITY, 0.05, 0.0), GOAL, always) == pytest.approx((0.0, 0.245))
    # Turning, it may be fast without that counting as not stopped.
    assert stop.command(Motion(IDENTITY, 0.0, 0.7), GOAL, always) == pytest.approx((0.0, 0.945))
    assert stop.command(Motion(Pose2D(0, 0, 0.97), 0.0, 0.3), GOAL, always) == (0.0, 0.0)


@pytest.mark.parametrize(
    ('yaw', 'angular', 'expected'),
    [
        (0.9, 0.0, 0.2),  # min_vel_theta, the rest of 0.1 rad would ask for less
        (-2.0, 0.9, 1.0),  # max_vel_theta
        (1.4, -0.5, -0.4),  # to the right, as fast as the rest in one second
        (0.7, 0.9, 0.655),
    ],
)  # no more braking than the acceleration limit
def test_turning_speed_keeps_all_limits(yaw, angular, expected):
    stop = controller()
    stop.command(Motion(Pose2D(0, 0, yaw), 0.0, 0.0), GOAL, always)  # it stands, so it turns
    assert stop.command(Motion(Pose2D(0, 0, yaw), 0.0, angular), GOAL, always)[1] == pytest.approx(expected)


def test_a_turn_that_would_collide_is_not_made():
    assert controller().command(Motion(IDENTITY, 0.0, 0.0), GOAL, lambda *_: False) is None


def test_a_unicycle_ends_at_the_heading():
    stop, yaw, speed = controller(), -2.0, 0.0
    for _ in range(200):
        motion = Motion(Pose2D(0.02, 0.0, yaw), 0.0, speed)
        if stop.is_goal_reached(motion, GOAL):
            break
        speed = stop.command(motion, GOAL, always)[1]
        yaw += speed * 0.05
    assert abs(wrap_angle(yaw - 1.0)) <= 0.052


# ---- recoveries


def view(base=IDENTITY, marked=(), now_s=0.0):
    """A robot in an empty hall with obstacles at points (x, y) of odom, which is map here."""
    grid = rasterise(shapes_of([], []), (-4.0, -4.0), (4.0, 4.0))
    maps = Costmap(CostmapParams(), grid), Costmap(local_defaults(width=6.0, height=6.0))
    for costmap in maps:
        for x, y in marked:
            costmap._obstacles[costmap.cell_at(x, y)] = LETHAL
        costmap._refresh(costmap._everything())
    return RecoveryView(int(now_s * 1e9), base, base, *maps)


def test_clearing_forgets_what_is_far_in_both_costmaps():
    before = view(marked=[(1.0, 0.0), (2.0, 0.0)])
    assert ClearCostmap('conservative_reset', 3.0).step(before).is_done
    for costmap in (before.global_costmap, before.local_costmap):
        assert costmap.cost_at(1.0, 0.0) == LETHAL and costmap.cost_at(2.0, 0.0) == 0


def test_rotation_goes_once_around():
    rotate, yaw, speeds = Rotate('turn', dwa_params()), 0.3, []
    for index in range(400):
        result = rotate.step(view(Pose2D(0.0, 0.0, wrap_angle(yaw)), now_s=0.05 * index))
        if result.is_done:
            break
        speeds.append(result.angular_radps)
        yaw += result.angular_radps * 0.05
    assert result.text == 'turned once around'
    assert yaw - 0.3 == pytest.approx(2.0 * math.pi, abs=0.1)
    assert set(speeds) == {1.0}  # max_vel_theta: 4.9 rad/s^2 stops it within 0.1 rad


def test_rotation_does_not_begin_where_it_would_collide():
    assert Rotate('turn', dwa_params()).step(view(marked=[(0.35, 0.0)])).text.startswith('cannot turn')
    assert not Rotate('turn', dwa_params()).step(view(marked=[(0.5, 0.0)])).is_done


def test_rotation_gives_up_on_a_robot_that_does_not_turn():
    rotate = Rotate('turn', dwa_params())
    assert not rotate.step(view()).is_done
    assert not rotate.step(view(now_s=30.0)).is_done
    assert 'does not follow' in rotate.step(view(now_s=32.0)).text


CLOSE_BY_M = 4.0 * math.hypot(0.26, 0.31)  # of ALTO's corners, with footprint_padding


def behaviours(**params):
    """(name, side of the square that is kept, or None for a turn) of what is tried, in order."""
    return [
        (recovery.name, getattr(recovery, '_reset_distance_m', None))
        for recovery in recoveries(
            NavigatorParams.from_mapping(
                {'local_costmap': {'rolling_window': True, 'global_frame': 'odom'}, **params}, ''
            ),
            Costmap(local_defaults()),
        )
    ]


def test_order_of_recoveries_is_move_bases():
    far, near = ('conservative_reset', 2.0), ('aggressive_reset', pytest.approx(CLOSE_BY_M))
    turn = ('rotate_recovery', None)
    assert behaviours(conservative_reset_dist=2.0) == [far, turn, near, turn]
    assert behaviours(conservative_reset_dist=2.0, clearing_rotation_allowed=False) == [far, near]
    assert behaviours(recovery_behavior_enabled=False) == []


def test_recoveries_are_those_that_are_listed():
    listed = [
        {'name': 'look_around', 'type': ROTATE},
        {'name': 'aggressive_reset', 'type': CLEAR_COSTMAP},
        {'name': 'mine', 'type': CLEAR_COSTMAP},
    ]
    assert behaviours(recovery_behaviors=listed, clearing_rotation_allowed=False) == [
        ('look_around', None),
        ('aggressive_reset', pytest.approx(CLOSE_BY_M)),
        ('mine', 3.0),
    ]


def test_a_margin_lets_the_robot_come_closer_before_it_turns():
    """Localization moves by millimetres while it turns: who stopped on the edge would be outside."""
    motion = Motion(Pose2D(0.0, 0.0, 0.0), 0.0, 0.0)
    for margin, distance_m, is_reached in ((0.0, 0.049, True), (0.2, 0.041, False), (0.2, 0.039, True)):
        controller = LatchedStopRotate(
            DwaParams.from_mapping(
                {'xy_goal_tolerance': 0.05, 'latch_margin': margin, 'latch_xy_goal_tolerance': True}, ''
            ),
            0.05,
        )
        assert controller.is_position_reached(motion, Pose2D(distance_m, 0.0, 0.0)) is is_reached
    assert controller.is_position_reached(motion, Pose2D(0.06, 0.0, 0.0))  # latched
