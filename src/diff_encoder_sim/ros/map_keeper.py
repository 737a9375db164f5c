"""Keeps the map that is being made, so that no fault loses it, and saves it."""

from __future__ import annotations

from pathlib import Path
from typing import Optional, Union

import rospy
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap

from diff_encoder_sim.base.errors import EVENT, ConfigError, InputFault
from diff_encoder_sim.mapping.map_files import save_map
from diff_encoder_sim.mapping.occupancy_grid import SAVED_MARGIN_M
from diff_encoder_sim.ros.map_conversions import grid_from_message
from diff_encoder_sim.ros.node import log, subscriber


class MapKeeper:
    """Listens to /map, and asks for the newest at the end."""

    def __init__(self, stem: Union[str, Path]) -> None:
        """`stem` is the path of the map files without suffix."""
        self._stem = Path(stem)
        self._newest: Optional[OccupancyGridMessage] = None
        self._is_saved = False
        self._maps = subscriber('map', OccupancyGridMessage, self._on_map)

    def _on_map(self, message: OccupancyGridMessage) -> None:
        self._newest = message

    @property
    def has_unsaved(self) -> bool:
        """Whether a map has come and none was saved yet."""
        return self._newest is not None and not self._is_saved

    def save(self) -> Path:
        """Write the map as it stands, or as it was last heard of; returns the YAML file's path.

        Raises:
            ConfigError: there is no map, or the files cannot be written.
        """
        message = self._map_as_it_stands() or self._newest
        if message is None:
            raise ConfigError(f'{self._stem}: there is no map to save')
        try:
            grid = grid_from_message(message).cropped(SAVED_MARGIN_M)
        except InputFault as fault:
            raise ConfigError(f'{self._stem}: {fault}') from None
        self._stem.parent.mkdir(parents=True, exist_ok=True)
        path = save_map(grid, self._stem)
        self._is_saved = True
        log.info('the map is saved: %s', path, extra=EVENT)
        return path

    @staticmethod
    def _map_as_it_stands() -> Optional[OccupancyGridMessage]:
        if rospy.is_shutdown():
            return None  # the mapper is going, too
        try:
            return rospy.ServiceProxy('dynamic_map', GetMap)().map
        except rospy.ServiceException:
            return None
