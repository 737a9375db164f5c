"""map_server_node: a map file on /map, /map_metadata and the service static_map."""
from __future__ import annotations

import sys
from typing import List

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapRequest, GetMapResponse
from pydantic import Field

from diff_encoder_sim.config import Params
from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.mapping.map_files import load_map
from diff_encoder_sim.ros.conversions import ns_from_stamp
from diff_encoder_sim.ros.map_conversions import map_message
from diff_encoder_sim.ros.node import node_params, publisher, run_node
from diff_encoder_sim.ros.trial_plan import trial_plan


class MapServerParams(Params):
    """Parameters of map_server_node."""

    frame_id: str = Field('map', min_length=1)


class MapServerNode:
    """Serves one map for as long as it lives."""

    def __init__(self, map_file: str) -> None:
        params = node_params(MapServerParams)
        grid = load_map(map_file)
        self._message = map_message(grid, ns_from_stamp(rospy.Time.now()), params.frame_id)
        self._maps = publisher('map', OccupancyGrid, latch=True)
        self._metadata = publisher('map_metadata', MapMetaData, latch=True)
        self._service = rospy.Service('static_map', GetMap, self._on_request)
        self._maps.publish(self._message)
        self._metadata.publish(self._message.info)

    def _on_request(self, _: GetMapRequest) -> GetMapResponse:
        return GetMapResponse(map=self._message)


def main() -> None:
    """Entry point of the executable: map_server_node MAP.yaml, as upstream's map_server.

    Without an argument it serves the map of the running trial.
    """
    run_node('map_server', lambda: MapServerNode(_map_file(rospy.myargv(sys.argv)[1:])))


def _map_file(arguments: List[str]) -> str:
    plan = trial_plan()
    if not arguments and plan is not None:
        return plan.map
    if len(arguments) == 2:  # an image and its resolution: upstream's deprecated form
        raise ConfigError(f'arguments: given {" ".join(arguments)!r}; allowed: one map .yaml file, '
                          f'which names the image and has the resolution')
    if len(arguments) != 1:
        raise ConfigError(f'arguments: given {" ".join(arguments)!r}; allowed: one map .yaml file')
    return arguments[0]
