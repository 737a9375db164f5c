"""diff-encoder-sim: entry point of the commands without ROS, installed by pip."""

from __future__ import annotations

import argparse
import sys
from operator import methodcaller
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import CONSOLE, as_called
from diff_encoder_sim.base.command_start import printing, run_command
from diff_encoder_sim.base.package_files import package_version

COMMANDS = {
    'campaign': 'run trials of several tests and encoders, faster than real time',
    'advise': 'find the encoder with the fewest pulses that keeps a robot within a tolerance',
    'analyze': 'make tables, figures and a report of a campaign, or of bags',
    'reencode': 'compute a recorded drive with other encoders',
    'calibrate': 'find wheels, separation and slip of a robot from its own drives',
    'conformance': 'judge the odometry of a recorded drive',
    'map_bag': 'build a map from the scans and the odometry in a bag',
    'check_robot': 'inspect a robot from its URDF, and check its simulated motion',
    'rasterise_world': 'make a map directly from a .world file',
}


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    with printing(CONSOLE):
        name = _parser().parse_args(given[:1]).command.replace('-', '_')
    run_command(as_called(name), f'cli.{name}', given[1:])


def _parser() -> argparse.ArgumentParser:
    shown = {name.replace('_', '-'): text for name, text in COMMANDS.items()}
    width = max(map(len, shown))
    commands = '\n'.join(f'  {name:{width}}  {text}' for name, text in shown.items())
    parser = argparse.ArgumentParser(
        prog=CONSOLE,
        usage=f'{CONSOLE} COMMAND ...',
        description='Which wheel encoder does a differential-drive robot need, and is its odometry right?',
        epilog=f'commands:\n{commands}\n\n{CONSOLE} COMMAND --help describes a command.',
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('--version', action='version', version=f'%(prog)s (diff_encoder_sim) {package_version()}')
    hyphened = methodcaller('replace', '_', '-')  # for the names of rosrun
    text = 'what to do; its arguments follow'
    parser.add_argument('command', metavar='COMMAND', type=hyphened, choices=list(shown), help=text)
    return parser
