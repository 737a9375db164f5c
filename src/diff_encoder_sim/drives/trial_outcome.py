"""How a trial ended."""

from __future__ import annotations

import enum
import math
from typing import Dict, NamedTuple, Optional

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.pose_source import PoseSource

# A robot that is farther from its goal has failed, whatever its pose estimate [m].
GOAL_DISTANCE_M = 0.5

# Final pose minus goal: x [m] and y [m] along the map's axes, yaw [rad] wrapped; None where the source had no pose.
FinalErrors = Dict[PoseSource, Optional[Pose2D]]


class Outcome(enum.Enum):
    """How a trial ended; all but SUCCEEDED are failures."""

    SUCCEEDED = 'succeeded'
    COLLISION = 'collision'  # it touched something other than the floor
    LOST = 'lost'  # localization gave up, or is wrong by more than GOAL_DISTANCE_M
    TIMED_OUT = 'timed_out'  # not at the end within the test's time_limit
    ABORTED = 'aborted'  # the navigator gave a goal up
    FAILED = 'failed'  # the ROS graph of a live trial did not come up, stalled or was stopped
    TORN = 'torn'  # the bag ends without a result

    @property
    def text(self) -> str:
        """Return the outcome as tables show it."""
        return self.value.replace('_', ' ')


class Ending(NamedTuple):
    """An outcome and, for a failure, its reason in one line."""

    outcome: Outcome
    reason: str = ''


class RouteFailed(Exception):
    """The route was not driven to its end: with the outcome and the reason."""

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.ending = Ending(outcome, reason)


def goal_error(true_pose_in_map: Pose2D, goal_in_map: Pose2D, limit_m: float = GOAL_DISTANCE_M) -> Optional[str]:
    """Return why a robot at this pose has failed to reach the goal, None where it is near enough."""
    distance_m = math.hypot(true_pose_in_map.x_m - goal_in_map.x_m, true_pose_in_map.y_m - goal_in_map.y_m)
    if distance_m <= limit_m:
        return None
    return f'the robot stands {distance_m:.2f} m from the goal; allowed: {limit_m:.2f} m'
