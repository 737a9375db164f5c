"""map_saver: writes the map on a topic to a map file, as upstream's map_saver."""

from __future__ import annotations

import argparse
from pathlib import Path

import rospy
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

from diff_encoder_sim.base.console import run_tool
from diff_encoder_sim.base.errors import EVENT, ConfigError, InputFault
from diff_encoder_sim.mapping.map_files import MapSaverParams, save_map
from diff_encoder_sim.ros.map_conversions import grid_from_message
from diff_encoder_sim.ros.node import log, run_node

REMIND_AFTER_S = 10.0


def main() -> None:
    """Entry point of the executable: saves one map and ends."""
    run_tool('map_saver', _run)


def _run() -> None:
    options = _parse()
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
        '%s: %d x %d cells of %g m are saved as %s',
        topic,
        grid.width,
        grid.height,
        grid.resolution_m,
        path.resolve(),
        extra=EVENT,
    )


def _next_map(topic: str) -> OccupancyGridMessage:
    """Waits as long as it takes, as upstream does, but says so."""
    while True:
        try:
            return rospy.wait_for_message(topic, OccupancyGridMessage, REMIND_AFTER_S)
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            log.warning('no map on %s yet: waiting', topic)


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='map_saver', description=__doc__, epilog='example: map_saver -f ~/maps/office map:=/my_map'
    )
    parser.add_argument(
        '-f',
        dest='stem',
        type=Path,
        default=Path('map'),
        metavar='STEM',
        help='writes STEM.pgm and STEM.yaml (default: %(default)s)',
    )
    parser.add_argument('--occ', type=int, default=65, help='occupied from here on [%%] (default: %(default)s)')
    parser.add_argument('--free', type=int, default=25, help='free up to here [%%] (default: %(default)s)')
    return parser.parse_args(rospy.myargv()[1:])
