"""Messages to the core's types: what is dropped, and what is refused."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import Quaternion, TransformStamped

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.ros import messages
from diff_encoder_sim.ros.maps import grid_from_message
from diff_encoder_sim.ros.messages import map_message

NAN = math.nan
POSE = Pose2D(1.5, -2.0, 2.5)
GRID = OccupancyGrid(np.array([[0, 100, -1], [0, 0, 50]], np.int8), 0.05, Pose2D(-1.0, 2.0, 0.5))


def test_stamps_and_poses_come_back():
    for stamp_ns in (0, 999_999_999, 1_795_318_047_650_452_001):
        assert messages.ns_from_stamp(messages.stamp_from_ns(stamp_ns)) == stamp_ns
    assert messages.pose_from_message(messages.pose_message(POSE)) == pytest.approx(POSE)


def test_height_roll_and_pitch_are_dropped():
    tilted = TransformStamped()
    tilted.transform.translation.z = 0.4
    # Yaw 90 degrees after a pitch of 10 degrees, of any length.
    sine, cosine = 2 * math.sin(math.radians(5)), 2 * math.cos(math.radians(5))
    tilted.transform.rotation = Quaternion(-sine, sine, cosine, cosine)
    assert messages.pose_from_transform(tilted) == pytest.approx((0.0, 0.0, math.pi / 2))


def test_a_map_comes_back_row_by_row_from_its_origin():
    message = map_message(GRID, 5, 'map')
    assert message.data == (0, 100, -1, 0, 0, 50) and (message.info.width, message.info.height) == (3, 2)
    message.info.resolution = float(np.float32(0.05))  # as it arrives
    grid = grid_from_message(message)
    assert (grid.cells == GRID.cells).all() and grid.origin == pytest.approx(GRID.origin)
    assert grid.resolution_m == 0.05


@pytest.mark.parametrize(
    'changes', [dict(width=2), dict(width=0, height=0), dict(resolution=0.0), dict(resolution=NAN)]
)
def test_what_is_no_map_is_refused(changes):
    message = map_message(GRID, 5, 'map')
    for name, value in changes.items():
        setattr(message.info, name, value)
    with pytest.raises(InputFault):
        grid_from_message(message)
