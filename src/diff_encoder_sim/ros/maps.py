"""Maps: grids from and to messages, the map of a topic or a service, the map kept for a display."""

from __future__ import annotations

import math
import threading
import time
from pathlib import Path
from typing import Callable, Optional, Union

import numpy as np
import rospy
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap

from diff_encoder_sim.base.errors import EVENT, ConfigError, InputFault
from diff_encoder_sim.localization.map_files import save_map
from diff_encoder_sim.localization.occupancy_grid import SAVED_MARGIN_M, OccupancyGrid
from diff_encoder_sim.ros.conversions import pose_from_message, pose_message, stamp_from_ns
from diff_encoder_sim.ros.node import MAP_LIMIT_S, call_service, log, subscriber


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


WARN_AFTER_S = 5.0
BETWEEN_REQUESTS_S = 1.0


def fetch_map(use_map: Callable[[OccupancyGridMessage], None]) -> None:
    """Call `use_map` once with the map, from a thread, as soon as a node serves it."""
    threading.Thread(target=_fetch, args=(use_map,), daemon=True).start()


def _fetch(use_map: Callable[[OccupancyGridMessage], None]) -> None:
    while not rospy.is_shutdown():
        try:
            rospy.wait_for_service('static_map', timeout=WARN_AFTER_S)
            message = call_service('static_map', GetMap, limit_s=MAP_LIMIT_S).map
        except (rospy.ROSException, rospy.ServiceException) as error:
            if not rospy.is_shutdown():
                log.warning('no map yet: %s; waiting for it', error)
                time.sleep(BETWEEN_REQUESTS_S)  # a server that has no map responds at once
            continue
        use_map(message)
        return


class MapKeeper:
    """Keeps the newest /map, and requests the current one from dynamic_map when it is saved."""

    def __init__(self, stem: Union[str, Path]) -> None:
        """Subscribe to the map; `stem` is the path of the map files without suffix."""
        self._stem = Path(stem)
        self._newest: Optional[OccupancyGridMessage] = None
        self._is_saved = False
        self._maps = subscriber('map', OccupancyGridMessage, self._on_map)

    def _on_map(self, message: OccupancyGridMessage) -> None:
        self._newest = message

    @property
    def has_unsaved(self) -> bool:
        """Whether a map has been received and none has been saved."""
        return self._newest is not None and not self._is_saved

    def save(self) -> Path:
        """Write the current map, or else the last one received; returns the YAML file's path.

        Raises:
            ConfigError: there is no map, or the files cannot be written.
        """
        message = self._current_map() or self._newest
        if message is None:
            raise ConfigError(f'{self._stem}: no map to save: none was published on {self._maps.resolved_name}')
        try:
            grid = grid_from_message(message).cropped(SAVED_MARGIN_M)
        except InputFault as fault:
            raise ConfigError(f'{self._stem}: {fault}') from None
        path = save_map(grid, self._stem)
        self._is_saved = True
        log.info('map saved: %s', path, extra=EVENT)
        return path

    @staticmethod
    def _current_map() -> Optional[OccupancyGridMessage]:
        if rospy.is_shutdown():
            return None  # the SLAM node is shutting down, too
        try:
            return call_service('dynamic_map', GetMap, limit_s=MAP_LIMIT_S).map
        except rospy.ServiceException:
            return None
