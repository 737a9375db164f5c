"""Maps: rosbags reads them, and would write the same bytes."""

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.drives.sensor_messages import encode_map, encode_map_metadata
from message_checks import check_header, check_pose, read, stamp_ns


def test_map_and_its_metadata(rng):
    grid, now_ns = values.grid(rng), values.stamp_ns(rng)
    message = read(encode_map(grid, now_ns, 'map'), 'nav_msgs/msg/OccupancyGrid')
    check_header(message.header, now_ns, 'map')
    assert np.array_equal(message.data.reshape(message.info.height, message.info.width), grid.cells)
    for info in (message.info, read(encode_map_metadata(grid, now_ns), 'nav_msgs/msg/MapMetaData')):
        assert (info.height, info.width) == grid.cells.shape
        assert info.resolution == pytest.approx(grid.resolution_m)
        assert stamp_ns(info.map_load_time) == now_ns
        check_pose(info.origin, grid.origin)
