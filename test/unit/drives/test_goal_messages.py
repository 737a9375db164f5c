"""Goals and results of move_base: rosbags reads them, and would write the same bytes."""

import pytest

import message_values as values
from diff_encoder_sim.drives.sensor_messages import SentGoal, encode_goal, encode_result
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from message_checks import check_header, check_pose, read, stamp_ns

SENT = SentGoal('/navigation_trial_node', 3, 5_610_000_000)


def test_goal(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    message = read(encode_goal(SENT, pose, now_ns, 'map'), 'move_base_msgs/msg/MoveBaseActionGoal')
    check_header(message.header, SENT.stamp_ns, '')
    assert (message.goal_id.id, stamp_ns(message.goal_id.stamp)) == ('/navigation_trial_node-3-5.610', SENT.stamp_ns)
    check_header(message.goal.target_pose.header, now_ns, 'map')
    check_pose(message.goal.target_pose.pose, pose)


@pytest.mark.parametrize(
    ('status', 'number'), [(GoalStatus.PREEMPTED, 2), (GoalStatus.SUCCEEDED, 3), (GoalStatus.ABORTED, 4)]
)
def test_result(status, number):
    message = read(encode_result(SENT, status, 'wörtlich', 7), 'move_base_msgs/msg/MoveBaseActionResult')
    check_header(message.header, 7, '')
    assert (message.status.status, message.status.text) == (number, 'wörtlich')
    assert message.status.goal_id.id == '/navigation_trial_node-3-5.610'


def test_only_a_goal_that_is_over_has_a_result():
    with pytest.raises(KeyError):
        encode_result(SENT, GoalStatus.ACTIVE, '', 7)
