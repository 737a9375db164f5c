"""map_saver: saves the map that is published on /map to an image and a YAML file."""

from __future__ import annotations

from pathlib import Path

import rospy
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import EVENT, ConfigError, InputFault
from diff_encoder_sim.localization.map_files import MapSaverParams, save_map
from diff_encoder_sim.ros.map_saver_arguments import parse
from diff_encoder_sim.ros.maps import grid_from_message
from diff_encoder_sim.ros.node import log, run_node

WARN_AFTER_S = 10.0


def main() -> None:
    """Run the command line: save one map and end."""
    run_tool('map_saver', _run)


def _run() -> None:
    options = parse()
    params = MapSaverParams.from_mapping({'free': options.free, 'occ': options.occ}, 'arguments')
    run_node('map_saver', lambda: _save_next_map(options.stem, params), lambda path: None)


def _save_next_map(stem: Path, params: MapSaverParams) -> None:
    topic = rospy.resolve_name('map')
    message = _next_map(topic)
    try:
        grid = grid_from_message(message)
    except InputFault as fault:
        raise ConfigError(f'{topic}: {fault}') from None
    path = save_map(grid, stem, params)
    log.info(
        '%s: map of %d x %d cells of %g m saved: %s',
        topic,
        grid.width,
        grid.height,
        grid.resolution_m,
        path.resolve(),
        extra=EVENT,
    )


def _next_map(topic: str) -> OccupancyGridMessage:
    """Wait as long as it takes, as upstream does, but with a warning now and then."""
    while True:
        try:
            return rospy.wait_for_message(topic, OccupancyGridMessage, WARN_AFTER_S)
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            log.warning('%s: no map has been published yet: waiting for one', topic)
