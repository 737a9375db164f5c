"""Which of reencode's options for drives without wheel angles go together."""

from __future__ import annotations

import argparse

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_robot import RecordedRobot
from diff_encoder_sim.drives.number_units import SPEEDS

# Options by the sources that they belong to.
_SOURCES = ('joint_states', 'pulses', 'ticks', 'odom', 'csv')
_BELONGS_TO = {
    'left': ('joint_states', 'pulses'),
    'right': ('joint_states', 'pulses'),
    'pulses_ppr': ('pulses', 'joint_states'),  # which may be found to be counts
    'unit': ('ticks', 'csv'),
    'ticks_per_revolution': ('ticks', 'csv'),
    'ticks_modulus': ('ticks', 'csv'),
    'reversed': ('ticks', 'csv'),
    'columns': ('csv',),
    'time_unit': ('csv',),
}


def check_wheel_options(options: argparse.Namespace) -> None:
    """Refuse options that contradict each other.

    Raises:
        ConfigError: there is more than one source, or an option of another one.
    """
    given = [name for name in _SOURCES if getattr(options, name)]
    if len(given) > 1:
        all_of_them = 'both' if len(given) == 2 else 'all'
        raise ConfigError(f'{", ".join(map(_option, given))}: given {all_of_them}; allowed: one of them')
    if bool(options.bag) == bool(options.csv):
        raise ConfigError(f'BAG, --csv: given {"both" if options.csv else "neither"}; allowed: one of them')
    if options.csv and not options.columns:
        raise ConfigError('--csv: given without --columns; expected --columns TIME LEFT RIGHT, as names or numbers')
    for name, sources in _BELONGS_TO.items():
        if getattr(options, name) not in (None, '', ()) and (given or ['joint_states'])[0] not in sources:
            used = _option(given[0]) if given else 'wheel angles of joints'
            allowed = ' or '.join(map(_option, sources))
            raise ConfigError(f'{_option(name)}: given with {used}; allowed: with {allowed}')


def check_seed(options: argparse.Namespace, robot: RecordedRobot) -> None:
    """Refuse a seed from which nothing is drawn: neither errors of an encoder, nor angles at the start.

    Raises:
        ConfigError: as said.
    """
    is_used = options.encoder or robot.draws_errors or options.odom or options.unit in SPEEDS
    if options.seed is not None and not is_used:
        raise ConfigError(
            f'--seed: given {options.seed}, but nothing is drawn from it; allowed: with --encoder, with errors of an '
            f'encoder in --config or --robot, with --odom, or with --unit {", ".join(SPEEDS)}'
        )


def _option(name: str) -> str:
    return f'--{name.replace("_", "-")}'
