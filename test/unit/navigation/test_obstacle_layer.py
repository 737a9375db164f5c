"""The obstacle layer on its own: moved, forgotten, cleared under a polygon."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.costmap_layers import FREE, LETHAL, NO_INFORMATION, GridWindow, ObstacleLayer
from diff_encoder_sim.navigation.costmap_params import CostmapParams

SHAPE = (20, 30)


def layer_of(unseen=NO_INFORMATION, **params):
    return ObstacleLayer(CostmapParams.from_mapping(params, ''), SHAPE, 20.0, unseen)


@pytest.mark.parametrize(('down', 'right'), [(0, 3), (-4, 0), (5, -7), (19, 29), (20, 0), (0, -30), (100, 100)])
def test_a_shift_keeps_what_stays_in_sight(down, right):
    layer = layer_of()
    before = np.random.default_rng(1).choice([FREE, LETHAL], SHAPE).astype(np.uint8)
    layer.cells = before
    layer.shift(down, right)
    for (row, column), cell in np.ndenumerate(layer.cells):
        was = row + down, column + right
        is_in_sight = 0 <= was[0] < SHAPE[0] and 0 <= was[1] < SHAPE[1]
        assert cell == (before[was] if is_in_sight else NO_INFORMATION)


def test_forgetting_keeps_a_window():
    layer = layer_of()
    layer.cells[:] = LETHAL
    layer.forget(GridWindow(3, 6, 10, 12))
    assert np.argwhere(layer.cells == LETHAL).tolist() == [[row, column] for row in (3, 4, 5) for column in (10, 11)]
    layer.forget()
    assert (layer.cells == NO_INFORMATION).all()


def test_a_polygon_clears_its_inside_and_its_sides():
    layer = layer_of()
    layer.cells[:] = LETHAL
    layer.clear_polygon(np.array([[0.51, 0.26], [0.51, 0.49], [0.29, 0.49], [0.29, 0.26]]))
    assert np.argwhere(layer.cells == FREE).tolist() == [
        [row, column] for row in range(5, 10) for column in range(5, 11)
    ]


def test_without_a_source_scans_are_not_entered():
    scan, laser = Scan(0, 0.0, 0.1, 0.15, 6.0, np.array([0.3, math.inf])), Pose2D(0.5, 0.5, 0.0)
    layer, none = layer_of(), layer_of(observation_sources='')
    for each in (layer, none):
        each.enter(scan, laser)
    assert layer.cells[10, 16] == LETHAL and layer.cells[10, 12] == FREE
    assert (none.cells == NO_INFORMATION).all()
