"""What a robot cannot do is known before it drives."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.simulation.simulator import DriveParams
from diff_encoder_sim.trials.route_driver import misfit

CELL_M = 0.05

WAY = {'goal': {'x': 6.0, 'y': 2.0, 'yaw': 0.0}}


def room_with_a_door(door_m):
    """8 m x 4 m, and a wall across at x = 4 m with a gap around y = 2 m."""
    cells = np.zeros((80, 160), np.int8)
    half = round(0.5 * door_m / CELL_M)
    cells[:, 80] = 100
    cells[40 - half : 40 + half, 80] = 0
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    return OccupancyGrid(cells, CELL_M, Pose2D(0.0, 0.0, 0.0))


def ask(door_m=1.5, size_m=(0.5, 0.6), drive=None, ahead_m=0.5, **test):
    length_m, side = size_m[0], 0.5 * size_m[1]
    front_m = ahead_m * length_m
    outline = [[front_m, -side], [front_m, side], [front_m - length_m, side], [front_m - length_m, -side]]
    costmaps = {name: {'footprint': outline} for name in ('global_costmap', 'local_costmap')}
    costmaps['local_costmap'].update(static_map=False, rolling_window=True, global_frame='odom')
    asked = {'name': 'T', 'world': 'w', 'start': {'x': 2.0, 'y': 2.0, 'yaw': 0.0}, 'route': [WAY], **test}
    return misfit(
        TestDefinition.from_mapping(asked, ''),
        NavigatorParams.from_mapping(costmaps, ''),
        DriveParams.from_mapping(drive or {}, ''),
        room_with_a_door(door_m),
    )


def test_a_robot_wider_than_a_door_is_refused():
    assert ask(size_m=(0.5, 1.8)).startswith('test T: not for this robot: ')
    assert ask(size_m=(0.5, 1.2)) is None


def test_width_counts_also_where_the_origin_is_near_the_front():
    """The circle inside its outline would pass; its sides do not."""
    assert 'touches a wall' in ask(size_m=(0.5, 1.8), ahead_m=0.1)


def test_a_turn_in_place_needs_room_for_the_corners():
    place = {'x': 2.0, 'y': 0.7, 'yaw': 0.0}
    turn = [{'turns': 1}, {'goal': place}]
    assert ask(size_m=(1.4, 0.5), start=place, route=turn) is not None
    assert ask(size_m=(0.6, 0.5), start=place, route=turn) is None


@pytest.mark.parametrize(('speed', 'is_refused'), [(0.5, False), (0.01, True)])
def test_a_robot_that_cannot_be_there_in_time_is_refused(speed, is_refused):
    answer = ask(drive={'max_linear_speed': speed}, time_limit=60.0)
    assert (answer is not None) == is_refused
    if is_refused:
        assert 'at least 4' in answer and 'at 0.01 m/s; time_limit is 60 s' in answer


def test_turns_in_place_take_their_time():
    turn = [{'turns': 10}, WAY]
    assert 'time_limit' in ask(route=turn, drive={'max_angular_speed': 0.1}, time_limit=600.0)
