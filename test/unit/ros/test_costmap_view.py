"""When a costmap is published whole, and when only its changes are."""

import numpy as np
import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import local_defaults
from diff_encoder_sim.ros.navigation_views import CostmapView
from recorded_topic import RecordedTopic

PERIOD_NS = 500_000_000  # of 2 Hz


class Watched:
    """A window with its view; what is published in a control period."""

    def __init__(self, **params):
        self.costmap = Costmap(local_defaults(publish_frequency=2.0, **params))
        self.view, self.now_ns = object.__new__(CostmapView), 0
        self.view._frame = 'odom'
        self.view._grids, self.view._updates, self.view._footprints = (RecordedTopic() for _ in range(3))
        self.view._shown_costs, self.view._shown_origin = np.empty((0, 0), np.uint8), IDENTITY

    def mark(self, x_m, y_m):
        self.costmap._obstacles[self.costmap.cell_at(x_m, y_m)] = 254
        self.costmap._changed = self.costmap._everything

    def show(self, after_ns=PERIOD_NS):
        """Whole costmaps and changes."""
        self.now_ns += after_ns
        self.view.show(self.costmap, None, self.now_ns)
        return self.view._grids.take(), self.view._updates.take()


def test_whole_at_first_and_then_the_cells_that_changed():
    watched = Watched(inflation_radius=0.0)
    watched.view._grids.newcomers = True
    whole, changes = watched.show()
    assert [(grid.info.width, grid.info.height) for grid in whole] == [(60, 60)] and changes == []
    assert watched.show() == ([], []), 'nothing has changed'
    watched.mark(0.52, 0.02)
    watched.mark(0.42, 0.07)
    assert watched.show(after_ns=1) == ([], []), 'not yet due'
    whole, (change,) = watched.show()
    assert whole == []
    assert (change.x, change.y, change.width, change.height) == (38, 30, 3, 2)
    assert change.data == [0, 0, 100, 100, 0, 0]


def test_whole_where_the_window_has_moved():
    watched = Watched()
    watched.show()
    watched.costmap.update(Pose2D(0.3, 0.0, 0.0))
    (grid,), changes = watched.show()
    assert grid.info.origin.position.x == pytest.approx(-1.2) and changes == []


@pytest.mark.parametrize(('params', 'has_listener'), [({'always_send_full_costmap': True}, True), ({}, False)])
def test_always_whole_on_request_and_where_nobody_hears_of_changes(params, has_listener):
    watched = Watched(**params)
    watched.view._updates.has_subscribers = has_listener
    for _ in range(3):
        watched.mark(0.5, 0.0)
        whole, changes = watched.show()
        assert len(whole) == 1 and changes == []
