"""The clouds of the DWA cost nothing that is not wanted."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.ros.navigation_views import DwaView, cloud_message
from navigation_scenes import PERIOD_S, local_costmap, straight_plan
from recorded_topic import RecordedTopic


def view():
    made = object.__new__(DwaView)
    made._frame, made._shown = 'odom', None
    made._trajectories, made._costs = RecordedTopic(), RecordedTopic()
    return made


def navigator(**params):
    """What the view looks at, after a control period."""
    dwa, costmap = DwaPlanner(DwaParams(**params), PERIOD_S), local_costmap()
    dwa.find_best(IDENTITY, 0.3, 0.0, costmap, straight_plan())
    return SimpleNamespace(
        scoring_task=dwa.last_task, local_costmap=costmap, params=SimpleNamespace(DWAPlannerROS=dwa.params)
    )


def test_each_cloud_has_its_parameter():
    for trajectories, costs in ((True, False), (False, True), (False, False)):
        shown = view()
        shown.show(navigator(publish_traj_pc=trajectories, publish_cost_grid_pc=costs), 0)
        assert [len(topic.take()) for topic in (shown._trajectories, shown._costs)] == [trajectories, costs]


def test_a_cloud_has_a_float_for_each_field():
    cloud = cloud_message(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.5]]), ('x', 'y', 'cost'), 1_500_000_000, 'odom')
    assert [(field.name, field.offset, field.datatype) for field in cloud.fields] == [
        ('x', 0, 7),
        ('y', 4, 7),
        ('cost', 8, 7),
    ]
    assert (cloud.width, cloud.height, cloud.point_step, cloud.row_step) == (2, 1, 12, 24)
    assert np.frombuffer(cloud.data, '<f4').tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.5]
    assert (cloud.header.frame_id, cloud.header.stamp.to_nsec()) == ('odom', 1_500_000_000)
