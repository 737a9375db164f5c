"""Recovery behaviours, step by step, and their order."""

import math

import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_layers import LETHAL
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.navigator_inputs import StartedRecovery, Trigger
from diff_encoder_sim.navigation.navigator_params import CLEAR_COSTMAP, ROTATE, NavigatorParams
from diff_encoder_sim.navigation.recovery import (
    ClearCostmap,
    Recovery,
    RecoverySequence,
    RecoveryStep,
    RecoveryView,
    Rotate,
    make_recoveries,
)
from navigation_scenes import dwa_params
from navigation_simulation import rasterise, shapes_of


def view(base=IDENTITY, marked=(), now_s=0.0):
    """A robot in an empty hall with obstacles at points (x, y) of odom, which is map here."""
    grid = rasterise(shapes_of([], []), (-4.0, -4.0), (4.0, 4.0))
    maps = Costmap(CostmapParams(), grid), Costmap(local_defaults(width=6.0, height=6.0))
    for costmap in maps:
        for x, y in marked:
            costmap._obstacles.cells[costmap.cell_at(x, y)] = LETHAL
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
    assert 'the robot does not turn' in rotate.step(view(now_s=32.0)).text


CLOSE_BY_M = 4.0 * math.hypot(0.26, 0.31)  # of ALTO's corners, with footprint_padding


def behaviours(**params):
    """(name, side of the square that is kept, or None for a turn) of what is tried, in order."""
    return [
        (recovery.name, getattr(recovery, '_reset_distance_m', None))
        for recovery in make_recoveries(
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


VIEW = RecoveryView(0, IDENTITY, IDENTITY, None, None)


class Counted(Recovery):
    """Is done in its second step."""

    def __init__(self, name):
        self.name, self.starts, self.steps = name, 0, 0

    def start(self):
        self.starts, self.steps = self.starts + 1, 0

    def step(self, view):
        self.steps += 1
        return RecoveryStep(self.steps == 2, text=f'step {self.steps}')


def run(sequence):
    """Texts of one behaviour, until it is done."""
    texts, result = [], RecoveryStep(False)
    while not result.is_done:
        result = sequence.step(VIEW)
        texts.append(result.text)
    return texts


def test_each_call_starts_the_next_behaviour():
    first, second = Counted('first'), Counted('second')
    sequence = RecoverySequence([first, second])
    for name in ('first', 'second'):
        assert not sequence.is_exhausted
        sequence.call(Trigger.CONTROLLING, 'blocked')
        assert run(sequence) == [f'{name}: step 1', f'{name}: step 2']
    assert sequence.is_exhausted and (first.starts, second.starts) == (1, 1)
    assert sequence.failure == 'no velocity command was found after 2 recovery behaviours: blocked'


def test_it_begins_anew_once_the_reason_of_the_last_call_is_over():
    sequence = RecoverySequence([Counted('first'), Counted('second')])
    sequence.call(Trigger.CONTROLLING, '')
    run(sequence)
    sequence.restart_after(Trigger.PLANNING)
    sequence.call(Trigger.CONTROLLING, '')
    assert run(sequence)[0] == 'second: step 1'
    sequence.restart_after(Trigger.CONTROLLING)
    sequence.call(Trigger.CONTROLLING, '')
    assert run(sequence)[0] == 'first: step 1'


def test_a_behaviour_is_reported_in_the_step_that_begins_it():
    sequence = RecoverySequence([Counted('first'), Counted('second')])
    for expected in (StartedRecovery('first', 0, 2), StartedRecovery('second', 1, 2)):
        sequence.call(Trigger.PLANNING, 'blocked')
        sequence.step(VIEW)
        assert sequence.started == expected
        sequence.step(VIEW)
        assert sequence.started is None
