"""The robot and the recorded drive that advise evaluates in place of simulated tests."""

from __future__ import annotations

import re
import sys
from dataclasses import fields
from pathlib import Path

from diff_encoder_sim.advice.drive_draws import STOP_OF_RECORDED, DrawnRobot, DriveDraws, recorded
from diff_encoder_sim.advice.odometry_study import AdvisedRobot, ordered_candidates
from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.options import AdviceOptions, RobotOptions, WheelOptions
from diff_encoder_sim.api.recorded_sources import open_drive
from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.reencoding import read_drive
from diff_encoder_sim.trials.campaign_loading import campaign_encoders
from diff_encoder_sim.trials.robot_params import wheel_errors_of
from diff_encoder_sim.wheels.catalogue import ChosenEncoder

TABLE_SUFFIXES = ('.csv', '.txt', '.tsv', '.dat')


def check_drive_options(options: AdviceOptions) -> None:
    """Refuse options of recorded drives without --drive, and those of tests with it, with a ConfigError."""
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
    given = {'ppr': options.ppr, 'encoders': options.encoders}
    encoders, seed = campaign_encoders(options.candidates, package_folder() / 'config', given)
    if own and not (options.ppr or options.encoders or robot.encoder.ppr in (each.ppr for each in encoders)):
        encoders.append(ChosenEncoder(robot.encoder.ppr))
    name = re.sub(r'[^A-Za-z0-9_.+-]+', '_', path.resolve().stem).lstrip('_.+-')[:60] or 'drive'
    label, errors = robot.file.label or name, wheel_errors_of(robot.file.overrides)
    with_params = ((each, wheel_options.parameters_with(each, robot.encoder, odometry)[0]) for each in encoders)
    drawn = DrawnRobot(None, errors, odometry, odometry.axle_x, STOP_OF_RECORDED, robot.file.calibration)
    tests = [DriveDraws(recorded(name, drive, drawn), drawn, seed)]
    return AdvisedRobot(label, own, tests, robot.encoder, ordered_candidates(with_params, label, own))
