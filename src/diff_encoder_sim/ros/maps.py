"""Map messages, and the nodes map_server_node and map_saver."""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import sys
import threading
import time
from pathlib import Path
from typing import Callable, Optional

import numpy as np
import rospy
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap, GetMapResponse, LoadMap, LoadMapRequest, LoadMapResponse
from pydantic import Field

from diff_encoder_sim.base.bounds import PERCENT
from diff_encoder_sim.base.command_line import number_within, tool_parser, user_errors
from diff_encoder_sim.base.errors import EVENT, ConfigError, InputFault, readable
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.localization.map_files import MapSaverParams, load_map, save_map
from diff_encoder_sim.localization.occupancy_grid import SAVED_MARGIN_M, OccupancyGrid
from diff_encoder_sim.ros import node
from diff_encoder_sim.ros.messages import Publisher, clock_ns, map_message, pose_from_message, subscriber


def grid_from_message(message: OccupancyGridMessage) -> OccupancyGrid:
    """Convert a map message to a grid; InputFault if the size, resolution or origin is invalid."""
    info = message.info
    if info.width * info.height == 0 or len(message.data) != info.width * info.height:
        size = f'{info.width} x {info.height} cells'
        raise InputFault(f'map of {size} with {len(message.data)} values; expected one per cell, at least one')
    if not (math.isfinite(info.resolution) and info.resolution > 0):
        raise InputFault(f'map resolution {info.resolution} m; expected a length greater than 0')
    cells = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)
    resolution_m = float(str(np.float32(info.resolution)))  # of 32 bits: 0.05 arrives as 0.05000000074505806
    return OccupancyGrid(cells, resolution_m, pose_from_message(info.origin))


def fetch_map(use_map: Callable[[OccupancyGridMessage], None]) -> None:
    """Call `use_map` once from a thread, when a node serves the map."""

    def fetch() -> None:
        while not rospy.is_shutdown():
            try:
                rospy.wait_for_service('static_map', timeout=5.0)
                message = node.call_service('static_map', GetMap, limit_s=node.MAP_LIMIT_S).map
            except (rospy.ROSException, rospy.ServiceException) as error:
                if not rospy.is_shutdown():
                    node.log.warning('no map yet: %s; waiting for it', error)
                    time.sleep(1.0)  # a server without a map responds immediately
            else:
                node.one_at_a_time(use_map)(message)
                return

    threading.Thread(target=fetch, daemon=True).start()


class MapKeeper:
    """Keeps the latest /map, and requests the current one from dynamic_map to save it as `stem`.pgm and .yaml."""

    def __init__(self, stem: str) -> None:
        self._stem = Path(stem)
        self._newest: Optional[OccupancyGridMessage] = None
        self.has_unsaved = False
        self._maps = subscriber('map', OccupancyGridMessage, self._on_map)

    def _on_map(self, message: OccupancyGridMessage) -> None:
        self._newest, self.has_unsaved = message, True

    def save(self) -> None:
        """Write the current map, or else the last one; ConfigError or InputFault if that is not possible."""
        message = self._newest
        if not rospy.is_shutdown():  # otherwise the SLAM node is shutting down, too
            with contextlib.suppress(rospy.ServiceException):
                message = node.call_service('dynamic_map', GetMap, limit_s=node.MAP_LIMIT_S).map
        if message is None:
            raise ConfigError(f'{self._stem}: no map to save: none was published on {self._maps.resolved_name}')
        path = save_map(grid_from_message(message).cropped(SAVED_MARGIN_M), self._stem)
        self.has_unsaved = False
        node.log.info('map saved: %s', path, extra=EVENT)


class MapServerParams(Params):
    """Parameters of map_server_node."""

    frame_id: str = Field('map', min_length=1, description='frame of the map')


class MapServerNode:
    """Serves a map file on /map, /map_metadata and static_map; change_map replaces it."""

    def __init__(self) -> None:
        arguments, plan = rospy.myargv(sys.argv)[1:], node.trial_plan()
        files = arguments or ([plan.map] if plan is not None else [])
        if len(files) != 1:
            raise ConfigError(f'arguments: given {" ".join(arguments)!r}; allowed: one map .yaml file')
        self._params = node.node_params(MapServerParams)
        self._message = self._load(files[0])
        self._maps = Publisher('map', OccupancyGridMessage, latch=True)
        self._metadata = Publisher('map_metadata', MapMetaData, latch=True)
        node.service('static_map', GetMap, lambda _: GetMapResponse(map=self._message))
        node.service('change_map', LoadMap, self._on_change)
        self._publish()

    def _load(self, map_file: str) -> OccupancyGridMessage:
        return map_message(load_map(map_file), clock_ns(), self._params.frame_id)

    def _publish(self) -> None:
        self._maps.publish(self._message)
        self._metadata.publish(self._message.info)

    def _on_change(self, request: LoadMapRequest) -> LoadMapResponse:
        """Respond as upstream; after an error the previous map is kept."""
        if not os.path.isfile(request.map_url):
            node.log.error('change_map: %s: no such file; keeping the previous map', readable(request.map_url))
            return LoadMapResponse(result=LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST)
        try:
            self._message = self._load(request.map_url)
        except ConfigError as error:
            node.log.error('change_map: %s; keeping the previous map', error)
            return LoadMapResponse(result=LoadMapResponse.RESULT_INVALID_MAP_DATA)
        self._publish()
        return LoadMapResponse(map=self._message, result=LoadMapResponse.RESULT_SUCCESS)


def parse_map_saver() -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('map_saver', str(map_saver.__doc__), ['-f ~/maps/office', '-f office map:=/my_map'])
    written, percent = 'write STEM.pgm and STEM.yaml (default: %(default)s)', number_within(PERCENT, int)
    parser.add_argument('-f', dest='stem', type=Path, default=Path('map'), metavar='STEM', help=written)
    for name, default, meaning in (('occ', 65, 'more is saved as occupied'), ('free', 25, 'less is saved as free')):
        text = f'a cell of this occupancy or {meaning} (default: %(default)s)'
        parser.add_argument(f'--{name}', type=percent, default=default, metavar='PERCENT', help=text)
    return parser.parse_args(node.own_words())


@user_errors('map_saver')
def map_saver() -> None:
    """map_saver: save the map that is published on /map to an image and a YAML file, as upstream's map_saver does."""
    options = parse_map_saver()
    params = MapSaverParams.from_mapping({'free': options.free, 'occ': options.occ}, 'arguments')
    node.executable('map_saver', _save_next_map, lambda _: None)(options.stem, params)


def _save_next_map(stem: Path, params: MapSaverParams) -> None:
    """Wait without a timeout, as upstream, with repeated warnings, and save the map."""
    topic, message = rospy.resolve_name('map'), None
    while message is None:
        try:
            message = rospy.wait_for_message(topic, OccupancyGridMessage, timeout=5.0)
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            node.log.warning('%s: no map has been published yet: waiting for one', topic)
    try:
        grid = grid_from_message(message)
    except InputFault as fault:
        raise ConfigError(f'{topic}: {fault}') from None
    saved = grid.width, grid.height, grid.resolution_m, save_map(grid, stem, params).resolve()
    node.log.info('%s: map of %d x %d cells of %g m saved: %s', topic, *saved, extra=EVENT)


map_server_node = node.executable('map_server', MapServerNode)
