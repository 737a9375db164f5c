"""Maps as messages and back."""

import math

import numpy as np
import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.ros.maps import grid_from_message, map_message

GRID = OccupancyGrid(np.array([[0, 100, -1], [0, 0, 50]], np.int8), 0.05, Pose2D(-1.0, 2.0, 0.5))


def test_a_map_comes_back_row_by_row_from_its_origin():
    message = map_message(GRID, 5, 'map')
    assert message.data == [0, 100, -1, 0, 0, 50] and (message.info.width, message.info.height) == (3, 2)
    grid = grid_from_message(message)
    assert (grid.cells == GRID.cells).all() and grid.origin == pytest.approx(GRID.origin)


def test_a_resolution_of_32_bits_is_read_as_it_was_written():
    message = map_message(GRID, 5, 'map')
    message.info.resolution = float(np.float32(0.05))
    assert grid_from_message(message).resolution_m == 0.05


@pytest.mark.parametrize(
    ('changes', 'complaint'),
    [
        (dict(width=2), 'map of 2 x 2 cells with 6 values'),
        (dict(width=0, height=0), 'map of 0 x 0 cells'),
        (dict(resolution=0.0), 'map resolution 0.0 m'),
        (dict(resolution=math.nan), 'map resolution nan m'),
    ],
)
def test_what_is_no_map_is_refused(changes, complaint):
    message = map_message(GRID, 5, 'map')
    for name, value in changes.items():
        setattr(message.info, name, value)
    with pytest.raises(InputFault, match=complaint):
        grid_from_message(message)
