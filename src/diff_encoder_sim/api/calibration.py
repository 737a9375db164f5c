"""Calibrate a robot from its own drives: by a reference, or by the squares of UMBmark."""

from __future__ import annotations

import hashlib
import json
import logging
import math
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np

from diff_encoder_sim.analysis.report.about import PageAbout, guide, robot_file, wheels_text
from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.options import CalibrateOptions
from diff_encoder_sim.api.recorded_sources import RECORDED_PPR, RecordedDrive, read_recorded
from diff_encoder_sim.api.wheel_options import RecordedRobot
from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.rounding import rounded
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.calibration import calibration_tables as tables
from diff_encoder_sim.calibration import estimation, umbmark
from diff_encoder_sim.calibration.estimation import Calibration, Estimated, ReferencedDrive
from diff_encoder_sim.calibration.prediction import Prediction, cross_predictions
from diff_encoder_sim.calibration.umbmark import LENGTHS, Umbmark, WheelGeometry
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.robots.calibration_file import CalibrationParams
from diff_encoder_sim.robots.robot_file import CALIBRATED_HEAD, ROBOT_FILE_SUFFIXES, calibrated_robot_text
from diff_encoder_sim.robots.wheel_quality import CALIBRATED
from diff_encoder_sim.trials.robot_params import load_robot_config, override, wheel_errors_of, wheel_uncertainty
from diff_encoder_sim.wheels.encoder_params import ppr_label
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.ros_parameters import RosParameters, RosWheels, amcl_alphas, ros_parameters

log = logging.getLogger(__name__)

PAGE = 'calibration.html'
LEAST_UPDATE = 0.01  # AMCL may be set to update at any motion [m, rad]
SHORTEST_NS = 12 * NANOSECONDS_PER_SECOND  # `estimation.SHORTEST_S`, and what the delay may take away


class Calibrated(NamedTuple):
    """A calibration, and its text report."""

    found: Union[Calibration, Umbmark]
    notes: List[str]  # on the drives, one line each
    text: str
    files: List[Path]  # written files


def calibrate(drives: Sequence[Union[str, Path]] = (), **options: Any) -> Union[Calibration, Umbmark]:
    """Calibrate a robot from recorded drives with a reference.

    Args:
        drives: bags; () if the option csv or ends is given.
        options: options of the command `calibrate`, see `CalibrateOptions`: csv, robot, reference, out, ...

    Raises:
        ConfigError: an option or a file is invalid, a file cannot be written, or the drives determine nothing.
    """
    paths = {key: Path(options[key]) for key in ('out', 'json', 'ends', 'config') if options.get(key) is not None}
    lists = {key: [Path(each) for each in options[key]] for key in ('csv', 'reference_csv') if options.get(key)}
    done = calibration(CalibrateOptions(**{**options, **paths, **lists, 'drives': [Path(each) for each in drives]}))
    for note in done.notes:
        log.warning('%s', note)
    return done.found


def calibration(options: CalibrateOptions) -> Calibrated:
    """Calibrate, and write the files of the options; errors as in `calibrate`."""
    _check(options)
    paths, tables_of = options.csv or options.drives, dict(enumerate(options.reference_csv))
    recorded = [read_recorded(options, path, bool(options.csv), tables_of.get(row)) for row, path in enumerate(paths)]
    robot = recorded[0].robot if recorded else wheel_options.recorded_robot(options, None)
    for each in recorded[1:]:
        if _nominal(each.robot) != _nominal(robot):
            others = f'{each.path} and {recorded[0].path}: given robots with different wheels'
            raise ConfigError(f'{others}; allowed: drives of one robot, or its geometry by --robot')
    return (_by_squares if options.umbmark else _by_reference)(options, robot, recorded)


def _check(options: CalibrateOptions) -> None:
    """Check options before drives are read."""
    if options.odom:
        reason = 'angles computed from odometry contain the very geometry that is to be estimated'
        raise ConfigError(f'--odom: given {options.odom}, but {reason}; allowed: counts, angles or speeds of wheels')
    if options.ends and (options.drives or options.csv or not options.umbmark):
        raise ConfigError(f'--ends: given {options.ends}; allowed: with --umbmark, in place of drives')
    if not options.ends:
        wheel_options.check_wheel_options(options, options.drives, options.csv)
    for name, path in (('--out', options.out), ('--json', options.json)):
        if path and (path.is_dir() or not path.parent.is_dir()):
            raise ConfigError(f'{name}: given {str(path)!r}; allowed: a file in a folder that exists')
    out, suffixes = options.out, ' or '.join(ROBOT_FILE_SUFFIXES)
    if out and out.suffix not in ROBOT_FILE_SUFFIXES:
        raise ConfigError(f'--out: given {out}; allowed: a name that ends in {suffixes}')
    if out and out.exists() and not out.read_bytes().startswith(CALIBRATED_HEAD.encode()):
        raise ConfigError(f'--out: given {out}, which calibrate has not written; allowed: a new file')


def _nominal(robot: RecordedRobot) -> Optional[WheelGeometry]:
    """Return the geometry that the user, a robot file or the bag's trial specifies."""
    if robot.is_guessed():
        return None
    diameter = robot.odometry.wheel_diameter
    return WheelGeometry(diameter.left, diameter.right, robot.odometry.wheel_separation)


def _by_reference(options: CalibrateOptions, robot: RecordedRobot, recorded: Sequence[RecordedDrive]) -> Calibrated:
    nominal = _nominal(robot)
    if nominal is None and options.unit.startswith('m'):
        raise ConfigError(f'--unit: given {options.unit} without the diameter it was computed with; expected --robot')
    drives = list(referenced(recorded))
    calibrated = estimation.calibrate(drives, nominal, has_slip_by_motion=options.slip_by_motion)
    found = _of_robot(calibrated, nominal, robot.odometry.axle_x)
    notes = [f'{each.path}: {note}' for each in recorded for note in each.notes]
    yaw = found.values.get('reference_yaw_rad')
    if yaw and math.cos(yaw.value) < 0.0:
        notes.append(
            f'the reference looks backward (yaw {math.degrees(yaw.value):.0f} degrees); if it does not, the wheels are '
            'swapped and reversed: give the other wheel first, and --reversed left right'
        )
    if found.support and len(found.unsupported) == len(found.support):
        notes.append('the drives do not support slip by motion; calibrate without --slip-by-motion')
    predictions: List[Prediction] = []
    try:
        predictions += cross_predictions(drives, nominal, found.parameters)
    except ConfigError as error:  # a part of the drives is not enough for a calibration
        notes.append(f'no prediction: {error}')
    own = {key: value for key, value in robot.file.overrides.items() if key.startswith('amcl.')}
    amcl = override(load_robot_config(package_folder() / 'config'), own).amcl
    sources = [{'file': str(each.path), 'sha256': _sha256(each.path)} for each in recorded]
    content = {**tables.calibration_json(found, predictions), 'drives': sources}
    numbers = {key: content[key] for key in CalibrationParams.model_fields if key in content}
    wheels = _ros_wheels(found, nominal, numbers, robot, recorded)
    exported = ros_parameters(wheels) if wheels else None
    content['diff_drive_controller'] = exported.diff_drive_controller if exported else {}
    content['amcl'] = _amcl_settings(wheels, amcl) if wheels else {}
    alphas = {f'amcl.{key}': value for key, value in content['amcl'].items() if key.startswith('odom_alpha')}
    files = _written(options, robot, recorded, content, numbers, alphas, exported)
    if options.out:
        from diff_encoder_sim.calibration.calibration_page import write_page  # noqa: PLC0415 - Altair takes a second

        files.insert(1, options.out.with_name(PAGE))
        left_m, right_m, separation_m = (found.values[name].value for name in LENGTHS)
        about = wheels_text(left_m, right_m, separation_m) if wheels else 'not determined'
        links = [*robot_file(str(options.out)), *map(guide, ('recorded_drives', 'index'))]
        write_page(found, predictions, nominal, sources, PageAbout('calibrate', about, links), files[1])
    text = tables.calibration_text(found, predictions, nominal is not None, exported.ros1 if exported else '')
    return Calibrated(found, notes, text, files)


def _of_robot(found: Calibration, nominal: Optional[WheelGeometry], axle_x_m: float) -> Calibration:
    """Return the sensor's place in the base frame instead of from the axle, and the nominal of undetermined lengths."""
    x_m, interval_m = found.values['reference_x_m']
    changed = {'reference_x_m': Estimated(x_m + axle_x_m, (interval_m[0] + axle_x_m, interval_m[1] + axle_x_m))}
    for name, length_m in zip(LENGTHS, nominal or ()):
        if name in found.undetermined:
            low_m, high_m = found.values[name].interval
            changed[name] = Estimated(length_m, (min(low_m, length_m), max(high_m, length_m)))
    return found._replace(values={**found.values, **changed})


def _ros_wheels(
    found: Calibration,
    nominal: Optional[WheelGeometry],
    numbers: Mapping[str, Any],
    robot: RecordedRobot,
    recorded: Sequence[RecordedDrive],
) -> Optional[RosWheels]:
    """Return the calibrated wheels for other packages; None if the geometry remains unknown."""
    if nominal is None and {*LENGTHS} & {*found.undetermined}:
        return None
    of_file = CalibrationParams.from_mapping(numbers, 'calibration').settings()
    uncertain = {key: value for key, value in of_file.items() if key.endswith(('_std', '_noise'))}
    settings = {**_geometry(WheelGeometry(*(found.values[name].value for name in LENGTHS))), **uncertain}
    about = f'calibrated on {len(recorded)} drive{"s" if len(recorded) > 1 else ""}'
    wheels = _with_counts(settings, robot, recorded, about)
    return wheels._replace(nominal_m=nominal, turn_noise=found.values['slip_rad2_per_rad'].value)


def _geometry(geometry: WheelGeometry) -> Dict[str, Any]:
    """Return the geometry as settings of a robot file."""
    left_m, right_m, separation_m = (rounded(length_m, 8) for length_m in geometry)
    return {'config.wheel_diameter': {'left': left_m, 'right': right_m}, 'config.wheel_separation': separation_m}


def _with_counts(
    settings: Mapping[str, Any], robot: RecordedRobot, recorded: Sequence[RecordedDrive], about: str
) -> RosWheels:
    """Return wheels by settings of a robot file, with the counts of the drives, else of the robot; else exact ones."""
    ppr = recorded[0].ppr if recorded else None
    if ppr is None and 'ppr' in robot.sources:
        ppr = robot.encoder.counts_per_turn
    values = {key[len('config.') :]: value for key, value in settings.items()}
    odometry = OdometryParams.from_mapping({**values, 'ppr': ppr.plain if ppr else RECORDED_PPR}, '')
    return RosWheels(odometry, f'{about}, {f"{ppr_label(ppr)} counts per wheel turn" if ppr else "unknown counts"}')


def _amcl_settings(wheels: RosWheels, amcl: AmclParams) -> Dict[str, Any]:
    """Return the alphas for this robot's AMCL, with the parameters for which they hold."""
    shown = {key: getattr(amcl, key) for key in ('odom_model_type', 'update_min_d', 'update_min_a')}
    steps = max(amcl.update_min_d, LEAST_UPDATE), max(amcl.update_min_a, LEAST_UPDATE)
    alphas = amcl_alphas(wheels, *steps, amcl.odom_model_type == 'diff-corrected')
    return {**shown, **{f'odom_{name}': alpha for name, alpha in alphas.items()}}


def referenced(recorded: Sequence[RecordedDrive]) -> Iterator[ReferencedDrive]:
    """Yield the parts of drives under short names."""
    names = [each.path.name for each in recorded]
    for each in recorded:
        name = each.path.name if names.count(each.path.name) == 1 else str(each.path)
        count_rad = (2.0 * math.pi / each.ppr.left, 2.0 * math.pi / each.ppr.right) if each.ppr else (0.0, 0.0)
        long = [part for part in each.parts if np.ptp(part[0].stamps_ns) > SHORTEST_NS]  # of parts after restarts
        for number, (drive, reference) in enumerate(long or each.parts, 1):
            yield ReferencedDrive(name if number == 1 else f'{name} #{number}', drive, reference, count_rad)


def _by_squares(options: CalibrateOptions, robot: RecordedRobot, recorded: Sequence[RecordedDrive]) -> Calibrated:
    nominal = _nominal(robot)
    if nominal is None:
        raise ConfigError('--robot: missing; expected the robot, whose nominal geometry UMBmark corrects')
    if options.ends:
        squares = umbmark.squares_of_ends(*umbmark.read_ends(options.ends), options.side, nominal)
    else:
        squares = []
        for drive, reference in [part for each in recorded for part in each.parts]:
            yaw_rad, axle = reference.poses[:, 2], reference.poses.copy()
            axle[:, :2] += robot.odometry.axle_x * np.column_stack((np.cos(yaw_rad), np.sin(yaw_rad)))
            squares += umbmark.find_squares(drive, reference._replace(poses=axle), nominal)
    found = umbmark.umbmark(squares, nominal)
    settings, errors = _geometry(found.corrected), wheel_errors_of(robot.file.overrides)
    uncertain = wheel_uncertainty(errors.model_copy(update=CALIBRATED.errors))
    about = 'corrected by UMBmark, then exact to 0.1 %'
    known = {**settings, **{f'config.{key}': value for key, value in uncertain.items()}}
    wheels = _with_counts(known, robot, recorded, about)
    exported = ros_parameters(wheels._replace(nominal_m=nominal))
    content = {**found.as_json(), 'diff_drive_controller': exported.diff_drive_controller}
    files = _written(options, robot, recorded, content, {}, settings, exported)
    return Calibrated(found, [], f'{found.text()}\n\n{exported.ros1}', files)


def _written(
    options: CalibrateOptions,
    robot: RecordedRobot,
    recorded: Sequence[RecordedDrive],
    content: Mapping[str, Any],
    numbers: Mapping[str, Any],
    settings: Mapping[str, Any],
    exported: Optional[RosParameters],
) -> List[Path]:
    """Write the robot file with the `numbers` of its calibration, JSON and parameters of ROS; return their paths."""
    texts = {}
    if options.out:
        base, nominal = robot.file, _nominal(robot)
        if recorded and recorded[0].ppr and isinstance(recorded[0].ppr.plain, (int, float)):
            base = base._replace(ppr=recorded[0].ppr.plain)
        if nominal is not None:  # holds where the drives determine nothing
            kept = {'config.wheel_diameter': robot.odometry.wheel_diameter.plain, 'config.wheel_separation': nominal[2]}
            base = base._replace(overrides={**kept, **base.overrides})
        is_simulated = any(each.trial for each in recorded)
        texts[options.out] = calibrated_robot_text(base, numbers, settings, options.out, is_simulated)
    if options.json:
        texts[options.json] = json.dumps(content, indent=1, allow_nan=False)
    for path, text in texts.items():
        write_file(path, text.encode('utf-8'))
    written = exported.write(options.out.parent, f'{options.out.stem}_') if exported and options.out else []
    return [*texts, *written]


def _sha256(path: Path) -> str:
    """Return the hash of a file, or of the files of a bag of ROS 2, which is a folder."""
    digest = hashlib.sha256()
    for file in sorted(path.iterdir()) if path.is_dir() else [path]:
        with open(file, 'rb') as opened:
            for block in iter(lambda: opened.read(2**20), b''):
                digest.update(block)
    return digest.hexdigest()
