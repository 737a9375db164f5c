"""Topics for displays: costmaps whole or as changes, clouds, diagnoses once a period."""

from types import SimpleNamespace

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import local_defaults
from diff_encoder_sim.ros import messages, navigation_views
from diff_encoder_sim.ros.amcl_node import spread_diagnosis
from diff_encoder_sim.ros.messages import Diagnostics, DisplayTopic
from diff_encoder_sim.ros.navigation_views import CostmapView, cloud_message
from diff_encoder_sim.wheels.diagnostics import Diagnosis

PERIOD_NS = 500_000_000  # of 2 Hz
MS = 1_000_000


class RecordedTopic(DisplayTopic):
    """Has a subscriber, and keeps what is published."""

    def __init__(self, *_, **__):
        self._known_count, self._due_ns, self._messages = 1, None, []
        self.publish, self.subscriber_count = self._messages.append, lambda: 1

    def take(self):
        """The messages since the last call."""
        messages = self._messages.copy()
        self._messages.clear()
        return messages


@pytest.fixture(autouse=True)
def fixture_recorded(monkeypatch):
    for module in (navigation_views, messages):
        monkeypatch.setattr(module, 'DisplayTopic', RecordedTopic)


class Watched:
    """A window with its view; what is published in a control period."""

    def __init__(self, **params):
        self.costmap = Costmap(local_defaults(publish_frequency=2.0, **params))
        self.view, self.now_ns = CostmapView('local_costmap', 'odom'), 0

    def mark(self, x_m, y_m):
        self.costmap._obstacles[self.costmap.cell_at(x_m, y_m)] = 254
        self.costmap._changed = self.costmap._everything

    def show(self, after_ns=PERIOD_NS):
        """Whole costmaps and changes."""
        self.now_ns += after_ns
        self.view.show(self.costmap, self.now_ns)
        return self.view._grids.take(), self.view._updates.take()


def test_a_costmap_is_whole_at_first_and_then_the_cells_that_changed():
    watched = Watched(inflation_radius=0.0)
    watched.view._grids._known_count = 0
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
    watched.costmap.update(Pose2D(0.3, 0.0, 0.0))
    (grid,), changes = watched.show()  # the window has moved
    assert grid.info.origin.position.x == pytest.approx(-1.2) and changes == []


@pytest.mark.parametrize(('params', 'has_listener'), [({'always_send_full_costmap': True}, True), ({}, False)])
def test_a_costmap_is_always_whole_on_request_and_without_subscribers_to_changes(params, has_listener):
    watched = Watched(**params)
    watched.view._updates.subscriber_count = lambda: has_listener
    for _ in range(2):
        watched.mark(0.5, 0.0)
        whole, changes = watched.show()
        assert len(whole) == 1 and changes == []


def test_a_cloud_has_a_float_for_each_field():
    place = messages.header(1_500_000_000, 'odom')
    cloud = cloud_message(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.5]]), ('x', 'y', 'cost'), place)
    fields = [(field.name, field.offset, field.datatype) for field in cloud.fields]
    assert fields == [('x', 0, 7), ('y', 4, 7), ('cost', 8, 7)]
    assert (cloud.width, cloud.height, cloud.point_step, cloud.row_step) == (2, 1, 12, 24)
    assert np.frombuffer(cloud.data, '<f4').tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.5]
    assert cloud.header == place


def test_a_diagnosis_is_published_once_a_period_of_stamps():
    diagnostics = Diagnostics('Odometry')
    warnings, counted = iter(['', 'lost reports: 3', '']), {'lost reports': 3, 'counts per second, left': 80.125}
    for stamp_ms in range(0, 2500, 50):
        diagnostics.publish_when_due(stamp_ms * MS, lambda: Diagnosis(next(warnings), counted))
    messages = diagnostics._topic.take()
    assert [message.header.stamp.to_sec() for message in messages] == [0.0, 1.0, 2.0]
    statuses = [message.status[0] for message in messages]
    assert [(status.level, status.message) for status in statuses] == [(0, 'OK'), (1, 'lost reports: 3'), (0, 'OK')]
    assert statuses[0].name.endswith(': Odometry')
    values = {value.key: value.value for value in statuses[0].values}
    assert values == {'lost reports': '3', 'counts per second, left': '80.125'}


@pytest.mark.parametrize(('limit_m', 'warning'), [(0.5, ''), (0.15, 'Too large')])
def test_the_spread_of_amcl_is_compared_with_its_limits(limit_m, warning):
    estimate = SimpleNamespace(covariance=np.diag([0.04, 0.01, 0.0025]))
    diagnosis = spread_diagnosis(estimate, AmclParams(std_warn_level_x=limit_m))
    assert diagnosis.warning == warning
    spread = {'std_x': 0.2, 'std_y': 0.1, 'std_yaw': 0.05}
    limits = {'std_warn_level_x': limit_m, 'std_warn_level_y': 0.2, 'std_warn_level_yaw': 0.1}
    assert diagnosis.values == pytest.approx({**spread, **limits})
