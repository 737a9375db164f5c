"""map_server_node: serves a map file on /map, /map_metadata and static_map; change_map replaces it."""

from __future__ import annotations

import os
import sys
from typing import List

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapRequest, GetMapResponse, LoadMap, LoadMapRequest, LoadMapResponse
from pydantic import Field

from diff_encoder_sim.base.errors import ConfigError, readable
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.ros.conversions import ns_from_stamp
from diff_encoder_sim.ros.maps import map_message
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node, trial_plan


class MapServerParams(Params):
    """Parameters of map_server_node."""

    frame_id: str = Field('map', min_length=1, description='frame of the map')


class MapServerNode:
    """Serves one map at a time."""

    def __init__(self, map_file: str) -> None:
        self._params = node_params(MapServerParams)
        self._message = self._load(map_file)
        self._maps = publisher('map', OccupancyGrid, latch=True)
        self._metadata = publisher('map_metadata', MapMetaData, latch=True)
        self._services = [
            rospy.Service('static_map', GetMap, self._on_get),
            rospy.Service('change_map', LoadMap, self._on_change),
        ]
        self._publish()

    def _load(self, map_file: str) -> OccupancyGrid:
        return map_message(load_map(map_file), ns_from_stamp(rospy.Time.now()), self._params.frame_id)

    def _publish(self) -> None:
        self._maps.publish(self._message)
        self._metadata.publish(self._message.info)

    def _on_get(self, _: GetMapRequest) -> GetMapResponse:
        return GetMapResponse(map=self._message)

    def _on_change(self, request: LoadMapRequest) -> LoadMapResponse:
        """Respond as upstream does; if a map cannot be loaded, the previous one is kept."""
        if not os.path.isfile(request.map_url):  # unlike Path's, also of a name that no file can have
            log.error('change_map: %s: no such file; keeping the previous map', readable(request.map_url))
            return LoadMapResponse(result=LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST)
        try:
            self._message = self._load(request.map_url)
        except ConfigError as error:
            log.error('change_map: %s; keeping the previous map', error)
            return LoadMapResponse(result=LoadMapResponse.RESULT_INVALID_MAP_DATA)
        self._publish()
        return LoadMapResponse(map=self._message, result=LoadMapResponse.RESULT_SUCCESS)


def main() -> None:
    """Run the node: `map_server_node MAP.yaml`, as upstream's map_server.

    Without an argument it serves the running trial's map.
    """
    run_node('map_server', lambda: MapServerNode(_map_file(rospy.myargv(sys.argv)[1:])))


def _map_file(arguments: List[str]) -> str:
    plan = trial_plan()
    if not arguments and plan is not None:
        return plan.map
    if len(arguments) == 2:  # an image and its resolution: upstream's deprecated form
        raise ConfigError(
            f'arguments: given {" ".join(arguments)!r}; allowed: one map .yaml file, '
            f'which names the image and its resolution'
        )
    if len(arguments) != 1:
        raise ConfigError(f'arguments: given {" ".join(arguments)!r}; allowed: one map .yaml file')
    return arguments[0]
