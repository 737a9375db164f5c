"""The goals and results of the move_base action."""

from __future__ import annotations

import struct
from typing import NamedTuple

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.pose_messages import encode_pose_stamped
from diff_encoder_sim.drives.primitives import encode_header, encode_text, encode_time
from diff_encoder_sim.navigation.goal_status import GoalStatus

_UINT8 = struct.Struct('<B')
# actionlib_msgs/GoalStatus of a goal that is over.
_ACTION_STATUS = {GoalStatus.PREEMPTED: 2, GoalStatus.SUCCEEDED: 3, GoalStatus.ABORTED: 4}


class SentGoal(NamedTuple):
    """What distinguishes a goal of an action from others: actionlib_msgs/GoalID."""

    node: str  # that sent it
    number: int  # of its goals, from 1
    stamp_ns: int  # when it was sent


def encode_goal(sent: SentGoal, goal_in_map: Pose2D, goal_stamp_ns: int, map_frame: str) -> bytes:
    """Encode move_base_msgs/MoveBaseActionGoal; `goal_stamp_ns` is of the pose, not of the sending."""
    target = encode_pose_stamped(goal_in_map, goal_stamp_ns, map_frame)
    return encode_header(sent.stamp_ns, '') + _encode_goal_id(sent) + target


def encode_result(sent: SentGoal, status: GoalStatus, text: str, stamp_ns: int) -> bytes:
    """Encode move_base_msgs/MoveBaseActionResult of a goal that is over; MoveBaseResult has no fields."""
    goal_status = _encode_goal_id(sent) + _UINT8.pack(_ACTION_STATUS[status]) + encode_text(text)
    return encode_header(stamp_ns, '') + goal_status


def _encode_goal_id(sent: SentGoal) -> bytes:
    """Encode actionlib_msgs/GoalID as actionlib's Python client makes it."""
    stamp_s = sent.stamp_ns / NANOSECONDS_PER_SECOND
    return encode_time(sent.stamp_ns) + encode_text(f'{sent.node}-{sent.number}-{stamp_s:.3f}')
