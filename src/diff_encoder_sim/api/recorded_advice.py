"""Robots that advise evaluates without a simulator: on a recorded drive, or two numbers on an ideal drive."""

from __future__ import annotations

import re
import sys
from dataclasses import fields
from pathlib import Path
from typing import Sequence

from diff_encoder_sim.advice import drive_draws
from diff_encoder_sim.advice.drive_draws import STOP_OF_RECORDED, DrawnRobot, ErrorFreeDrive
from diff_encoder_sim.advice.odometry_study import AdvisedRobot, ordered_candidates
from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.options import AdviceOptions, RobotOptions, WheelOptions
from diff_encoder_sim.api.recorded_sources import open_drive
from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.reencoding import read_drive
from diff_encoder_sim.drives.test_definition import Leg, PoseParams, Segment, TestDefinition
from diff_encoder_sim.simulation.slip import WheelErrorParams
from diff_encoder_sim.trials.campaign_loading import campaign_encoders
from diff_encoder_sim.trials.robot_params import wheel_errors_of
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

TABLE_SUFFIXES = ('.csv', '.txt', '.tsv', '.dat')
NUMBERS, DISTANCE_M = ('wheel_diameter', 'wheel_separation'), 10.0  # of an ideal robot; its straight drive


def check_drive_options(options: AdviceOptions) -> None:
    """Refuse options of recorded drives without --drive, and of tests with it or two numbers, with a ConfigError."""
    numbers = [getattr(options, key) for key in NUMBERS]
    if numbers.count(None) == 1:
        raise ConfigError('--wheel-diameter, --wheel-separation: given one of them; expected both')
    for name in ('robot', 'drive', 'tests', 'trials', 'amcl') if any(numbers) else ():
        if getattr(options, name) is not None:
            raise ConfigError(f'--{name}: given with --wheel-diameter; allowed: one of them')
    if options.turns != AdviceOptions.turns and not any(numbers):
        raise ConfigError('--turns: given without --wheel-diameter; expected --wheel-diameter and --wheel-separation')
    if options.drive is None:
        own = {each.name for each in fields(RobotOptions)} | {'robot'}
        for each in fields(WheelOptions):
            if each.name not in own and getattr(options, each.name) != each.default:
                raise ConfigError(f'--{each.name.replace("_", "-")}: given without --drive; expected --drive BAG|TABLE')
        return
    for name in ('tests', 'distance', 'trials'):
        if getattr(options, name) is not None:
            raise ConfigError(f'--{name}: given with --drive, which has no trials; allowed: one of them')
    is_table = bool(options.columns)
    if not is_table and options.drive.suffix in TABLE_SUFFIXES:
        raise ConfigError(f'{options.drive}: a table is given without --columns; expected --columns TIME LEFT RIGHT')
    wheel_options.check_wheel_options(options, not is_table and options.drive, is_table and options.drive)


def robot_of_drive(options: AdviceOptions, path: Path) -> AdvisedRobot:
    """Read a recorded drive for its robot, which needs no URDF; ConfigError if an option or the file is invalid."""
    source, _, robot, wheels, _ = open_drive(options, path, bool(options.columns), has_encoders=True)
    read = read_drive(source, wheels, None)
    for note in (*read.notes, *filter(None, [source.fault])):
        print(f'{as_called("advise")}: {path}: {note}', file=sys.stderr)
    drive = max((timed.drive for timed in read.drives), key=len, default=None)  # after a restart the longest part
    if drive is None or len(drive) < 2:
        raise ConfigError(f'{path}: no drive in {read.messages} {wheels.text}; expected two samples of the wheels')
    odometry, own = robot.odometry, robot.encoder.ppr.left if 'ppr' in robot.sources else None
    name = re.sub(r'[^A-Za-z0-9_.+-]+', '_', path.resolve().stem).lstrip('_.+-')[:60] or 'drive'
    label, errors = robot.file.label or name, wheel_errors_of(robot.file.overrides)
    drawn = DrawnRobot(None, errors, odometry, odometry.axle_x, STOP_OF_RECORDED, robot.file.calibration)
    about = AdvisedRobot(label, own, [], robot.encoder, [], robot.file.where)
    return _with_candidates(options, about, drawn, [drive_draws.recorded(name, drive, drawn)])


def robot_of_numbers(options: AdviceOptions) -> AdvisedRobot:
    """Return a robot of two numbers on ideal drives: a straight line, and turns in place; ConfigError if invalid."""
    odometry = OdometryParams.from_mapping({key: getattr(options, key) for key in NUMBERS}, '')
    drawn = DrawnRobot(None, WheelErrorParams(), odometry, odometry.axle_x, STOP_OF_RECORDED)
    like = TestDefinition(name='ideal', world='none', route=[Leg(goal=PoseParams())])
    segments = [Segment(straight=options.distance or DISTANCE_M), Segment(turns=options.turns)]
    drives = [drive_draws.ideal(drive_draws.test_of(each, like), drawn) for each in segments if any(each.motion)]
    label = f'{options.wheel_diameter:g} m wheels, {options.wheel_separation:g} m apart'
    return _with_candidates(options, AdvisedRobot(label, None, [], EncoderParams(), []), drawn, drives)


def _with_candidates(
    options: AdviceOptions, about: AdvisedRobot, robot: DrawnRobot, drives: Sequence[ErrorFreeDrive]
) -> AdvisedRobot:
    """Return a robot with drives and the candidates of the options, by default with its own encoder."""
    own, encoder = about.own_counts, about.encoder
    given = {'ppr': options.ppr, 'encoders': options.encoders}
    encoders, seed = campaign_encoders(options.candidates, package_folder() / 'config', given)
    if own and not (options.ppr or options.encoders or encoder.ppr in (each.ppr for each in encoders)):
        encoders.append(ChosenEncoder(encoder.ppr))
    with_params = ((each, wheel_options.parameters_with(each, encoder, robot.odometry)[0]) for each in encoders)
    tests = [drive_draws.DriveDraws(drive, robot, seed) for drive in drives]
    return about._replace(tests=tests, candidates=ordered_candidates(with_params, about.name, own))
