"""The robot of a recorded drive: its wheels as options, robot file or bag tell them, each with where it is from.

Precedence, the strongest first: --left, --right; --config; --robot; the bag's /trial; config/config.yaml. Of a --config
beside a --robot, what differs from the package's file counts, as for launch files.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional

from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import merged, nested, shared_params
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.topics import TRIAL
from diff_encoder_sim.drives.trial_definition import OF_ENCODER, OF_ODOMETRY, Trial
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.trials.robot_loading import load_robot
from diff_encoder_sim.trials.wheel_uncertainty import uncertainty_of_robot
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, OdometryParams
from diff_encoder_sim.wheels.report_link import PROMPT
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

USUAL = 'config/config.yaml'


class RecordedRobot(NamedTuple):
    """Parameters that a drive is read with."""

    encoder: EncoderParams
    odometry: OdometryParams
    counts_modulus: int  # of recorded counts; encoders that are computed have their own
    sources: Dict[str, str]  # by the parameter's name; of ppr only where a file gives it

    def is_guessed(self) -> bool:
        """Return whether neither the user nor the bag says what the wheels are."""
        return all(self.sources[name] == USUAL for name in OF_ODOMETRY)

    @property
    def draws_errors(self) -> bool:
        """Return whether the robot's own encoder has errors that are drawn from the seed."""
        return self.encoder.encoder != IDEAL_ENCODER or self.encoder.report != PROMPT

    def counter_text(self) -> str:
        """Return where recorded counts wrap, with its source."""
        wraps = f'wrap at {self.counts_modulus}' if self.counts_modulus else 'do not wrap'
        return f'counts {wraps}: {self.sources["counter_modulus"]}'

    def text(self) -> str:
        """Return the wheels with their sources, in one line."""
        odometry = self.odometry
        values = {
            'wheel_diameter': f'diameter {odometry.wheel_diameter:g} m',
            'wheel_separation': f'separation {odometry.wheel_separation:g} m',
            'axle_x': f'axle at x = {odometry.axle_x:g} m',
            'left_joint': f'left joint {self.encoder.left_joint}',
            'right_joint': f'right joint {self.encoder.right_joint}',
        }
        by_source: Dict[str, List[str]] = {}
        for name, value in values.items():
            by_source.setdefault(self.sources[name], []).append(value)
        return 'wheels: ' + '; '.join(f'{", ".join(parts)} ({source})' for source, parts in by_source.items())


def recorded_robot(options: argparse.Namespace, trial: Optional[Trial]) -> RecordedRobot:
    """Collect the parameters of a recorded drive.

    Raises:
        ConfigError: a file is missing or bad, or a value is not allowed.
    """
    usual = load_yaml(package_folder() / 'config' / 'config.yaml')
    values, sources = dict(usual), dict.fromkeys([*OF_ODOMETRY, *OF_ENCODER], USUAL)

    def add(layer: Dict[str, Any], source: str) -> None:
        values.update(merged(values, layer))
        sources.update(dict.fromkeys(layer, source))

    if trial is not None:
        of_trial = {name: getattr(trial, name) for name in (*OF_ODOMETRY, *UNCERTAINTY_KEYS, *OF_ENCODER)}
        add({**of_trial, 'seed': trial.number}, f"the bag's {TRIAL}")
    if options.robot:
        arguments = xacro_arguments(options.robot_args)
        robot = load_robot(options.robot, Path(), package_folder(), arguments, options.packages)
        add(nested(_encoder_and_odometry(robot.settings, options)), robot.file.where)
        if robot.file.ppr is not None:
            add({'ppr': robot.file.ppr}, robot.file.where)
    if options.config:
        given = load_yaml(options.config)
        add(
            {key: value for key, value in given.items() if not options.robot or usual.get(key) != value},
            str(options.config),
        )
    if options.seed is not None:
        add({'seed': options.seed}, '--seed')
    name = str(options.config or options.robot or USUAL)
    encoder = shared_params(values, name, EncoderParams, OdometryParams)
    odometry = shared_params(values, name, OdometryParams, EncoderParams)
    return RecordedRobot(encoder, odometry, _counts_modulus(encoder, trial, options.config, sources), sources)


def _counts_modulus(
    encoder: EncoderParams, trial: Optional[Trial], config: Optional[Path], sources: Dict[str, str]
) -> int:
    """Return where recorded counts wrap: as /trial has it before --robot, whose encoder need not be the recorded one.

    It is not that of encoders to compute.
    """
    given = sources.setdefault('counter_modulus', USUAL)
    if trial is None or given == str(config) or (given != USUAL and not trial.counter_modulus):
        return encoder.counter_modulus
    sources['counter_modulus'] = f"the bag's {TRIAL}"
    return trial.counter_modulus


def _encoder_and_odometry(of_robot: Mapping[str, Any], options: argparse.Namespace) -> Dict[str, Any]:
    """Return what a robot sets of config.yaml, by dotted keys; its own resolution gives way to --ppr and --encoder."""
    gives_way = RESOLUTION_KEYS if options.ppr or options.encoder else ()
    values = {key: value for key, value in of_robot.items() if key not in gives_way}
    of_config = {key.partition('.')[2]: value for key, value in values.items() if key.startswith('config.')}
    return {**uncertainty_of_robot(of_robot), **of_config}
