"""Maps: OccupancyGrid and MapMetaData."""

from __future__ import annotations

import struct

from diff_encoder_sim.drives.pose_messages import encode_planar_pose
from diff_encoder_sim.drives.primitives import encode_array, encode_header, encode_time
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid

_RESOLUTION_WIDTH_HEIGHT = struct.Struct('<f2I')


def encode_map(grid: OccupancyGrid, stamp_ns: int, frame: str) -> bytes:
    """Encode nav_msgs/OccupancyGrid, row by row from the origin."""
    return encode_header(stamp_ns, frame) + encode_map_metadata(grid, stamp_ns) + encode_array(grid.cells, 'i1')


def encode_map_metadata(grid: OccupancyGrid, stamp_ns: int) -> bytes:
    """Encode nav_msgs/MapMetaData."""
    size = _RESOLUTION_WIDTH_HEIGHT.pack(grid.resolution_m, grid.width, grid.height)
    return encode_time(stamp_ns) + size + encode_planar_pose(grid.origin)
