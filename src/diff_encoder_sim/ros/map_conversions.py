"""Conversions between occupancy grids and nav_msgs/OccupancyGrid."""

from __future__ import annotations

import math

import numpy as np
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.ros.conversions import pose_from_message, pose_message, stamp_from_ns


def map_message(grid: OccupancyGrid, stamp_ns: int, frame: str) -> OccupancyGridMessage:
    """Convert a grid to a message, row by row from the origin."""
    stamp = stamp_from_ns(stamp_ns)
    info = MapMetaData(
        map_load_time=stamp,
        resolution=grid.resolution_m,
        width=grid.width,
        height=grid.height,
        origin=pose_message(grid.origin),
    )
    message = OccupancyGridMessage(info=info, data=grid.cells.ravel().tolist())
    message.header.stamp = stamp
    message.header.frame_id = frame
    return message


def grid_from_message(message: OccupancyGridMessage) -> OccupancyGrid:
    """Convert a map message to a grid.

    Raises:
        InputFault: its size, resolution or origin are not those of a map.
    """
    info = message.info
    if info.width * info.height == 0 or len(message.data) != info.width * info.height:
        raise InputFault(
            f'map of {info.width} x {info.height} cells with {len(message.data)} '
            f'values; expected one value for each cell, and at least one cell'
        )
    if not (math.isfinite(info.resolution) and info.resolution > 0):
        raise InputFault(f'map resolution {info.resolution} m; expected a length greater than 0')
    cells = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)
    # The field is 32 bits wide: 0.05 arrives as 0.05000000074505806.
    resolution_m = float(str(np.float32(info.resolution)))
    return OccupancyGrid(cells, resolution_m, pose_from_message(info.origin))
