"""Saving the map that a SLAM node builds: as it is at the end, or as last published if the node has died."""

from __future__ import annotations

from pathlib import Path
from typing import Optional, Union

import rospy
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap

from diff_encoder_sim.base.errors import EVENT, ConfigError, InputFault
from diff_encoder_sim.localization.map_files import save_map
from diff_encoder_sim.localization.occupancy_grid import SAVED_MARGIN_M
from diff_encoder_sim.ros.map_conversions import grid_from_message
from diff_encoder_sim.ros.node import log, subscriber
from diff_encoder_sim.ros.service_call import MAP_LIMIT_S, call_service


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
