"""Read results from a campaign's folder or from bags of trials."""

from __future__ import annotations

import json
import logging
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Dict, Iterable, List, NamedTuple, Sequence, Tuple, Union

import numpy as np

from diff_encoder_sim.analysis import results_table
from diff_encoder_sim.analysis.encoder_labels import IDEAL
from diff_encoder_sim.analysis.results_table import Results, RobotGeometry
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.processes import interrupts_blocked, usable_cores
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries, transform_points, wrap_angle, wrap_angles
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import bags_in
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trajectory_error import path_error
from diff_encoder_sim.drives.trial_definition import FinalErrors, Outcome, Trial
from diff_encoder_sim.drives.trial_recording import POSE_TOPICS, read_trial
from diff_encoder_sim.trials.trials_csv import BAGS, MANIFEST, TABLE, VARIANT, TrialRow, read_rows
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS

log = logging.getLogger(__name__)

BAGS_PER_TASK = 4  # chunk size per process that makes the overhead negligible
KEPT_APART = ('nav', 'fusion', VARIANT, 'wheel_diameter', 'wheel_separation')  # bags that differ in one are not pooled


def load_results(paths: Sequence[Path]) -> Results:
    """Read a campaign's folder or bags of trials, without invalid ones (a warning); ConfigError if none is valid."""
    campaigns = [path for path in paths if path.is_dir() and (path / MANIFEST).is_file()]
    if campaigns and len(paths) > 1:
        raise ConfigError(f"{campaigns[0]}: a campaign's folder; expected only this folder, or bags")
    results = read_campaign(campaigns[0]) if campaigns else read_bags(paths)
    for note in results.notes:
        log.warning('%s', note)
    return results


def read_campaign(folder: Path) -> Results:
    """Read a campaign's folder, with or without bags; ConfigError if no trial is finished or a file is invalid."""
    manifest, requested, robot, varied, count = _manifest(folder / MANIFEST)
    rows, notes = _rows(folder / TABLE, varied, requested)
    if len(rows) < count:
        notes.append(f'{folder / TABLE}: has {len(rows)} of {count} trials; the same campaign command runs the others')
    if not rows:
        raise ConfigError(f'{folder}: no trial is finished; expected at least one')
    records: List[Dict[str, Any]] = [{**results_table.record_of(row), 'bag': ''} for row in rows]
    bags = {index: folder / row.bag for index, row in enumerate(rows) if row.bag and (folder / row.bag).is_file()}
    if len(bags) < len(rows):
        text = f'has bags of {len(bags)} of {len(rows)} trials; the others have no errors along the path'
        notes.append(f'{folder / BAGS}: {text}')
    for index, bag in zip(bags, read_bag_trials(list(bags.values()))):
        if isinstance(bag, str):
            notes.append(bag)
        elif all(bag.record[key] == records[index][key] for key in ('test', 'ppr', 'seed')):
            names = {'bag', *results_table.PATH_COLUMNS}.intersection(bag.record)
            records[index].update({name: bag.record[name] for name in names})
        else:
            notes.append(f'{bag.record["bag"]}: differs from its line in trials.csv; expected the same trial')
    trials = results_table.trials_table(records, varied)
    return Results(trials, varied, manifest['name'], notes, manifest, folder, robot, requested)


def _manifest(path: Path) -> Tuple[Dict[str, Any], Dict[str, Trial], RobotGeometry, List[str], int]:
    """Return the manifest, one trial per test, the robot, the varied keys and the number of trials."""
    try:
        manifest = json.loads(path.read_text(encoding='utf-8'))
        configuration = {'encoders': [], **manifest['configuration']}
        tests = [{key: test[key] for key in test if key != 'files'} for test in configuration['tests']]
        sets, encoders = configuration['parameters'], [*configuration['ppr'], *configuration['encoders']]
        wheels, varied = sets[0]['odometry'], sorted(sets[0]['varied'])
        common = {key: wheels[key] for key in UNCERTAINTY_KEYS if key in wheels}
        common.update(wheel_diameter=wheels['wheel_diameter'], wheel_separation=wheels['wheel_separation'])
        common['nav'] = configuration['nav']
        trials = [Trial.from_mapping({**common, 'test': test}, str(path)) for test in tests]
        robot = RobotGeometry(trials[0].wheel_diameter.mean, trials[0].wheel_separation)
        count = len(tests) * len(sets) * len(encoders) * int(configuration['trials'])
        manifest['name'] = str(manifest['name'])
        return manifest, {trial.test.name: trial for trial in trials}, robot, varied, count
    except (KeyError, IndexError, TypeError, AttributeError, json.JSONDecodeError, UnicodeDecodeError):
        raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it') from None
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None


def _rows(path: Path, varied: Sequence[str], tests: Iterable[str]) -> Tuple[List[TrialRow], List[str]]:
    """Return the lines of trials.csv, and a note if the last one is incomplete."""
    rows: Dict[Tuple[object, ...], TrialRow] = {}
    try:
        is_torn = not path.read_bytes().endswith(b'\n')
        for row in read_rows(path, varied, lambda row: row.test in tests and row.identity() not in rows):
            rows[row.identity()] = row
    except OSError as error:
        text = f'cannot be read: {error.strerror}; expected a folder that campaign wrote, or bags'
        raise ConfigError(f'{path}: {text}') from None
    return list(rows.values()), [f'{path}: the last line is incomplete; its trial is left out'] if is_torn else []


class TrialOfBag(NamedTuple):
    """Trial read from its bag."""

    trial: Trial
    record: Dict[str, Any]  # results by column of the table


def read_bags(paths: Sequence[Path]) -> Results:
    """Read bags, and folders of bags; ConfigError if there is no valid bag, or a folder contains a campaign."""
    files: List[Path] = []
    for path in paths:
        campaigns = sorted(file.parent for file in path.rglob(MANIFEST)) if path.is_dir() else []
        if campaigns:
            raise ConfigError(f'{path}: contains the results of a campaign in {campaigns[0]}; expected that folder')
        files += bags_in(path) if path.is_dir() else [path]
        if path.is_dir() and not bags_in(path):
            raise ConfigError(f"{path}: no bag in this folder, and no campaign's results")
    read = read_bag_trials(files)
    notes = [bag for bag in read if isinstance(bag, str)]
    tests: Dict[str, TrialOfBag] = {}
    trials: Dict[str, TrialOfBag] = {}
    for bag in (bag for bag in read if not isinstance(bag, str)):
        name, file = bag.trial.test.name, bag.record['bag']
        first = tests.setdefault(name, bag)
        if bag.trial.test != first.trial.test:
            text = f'defines {name} differently from {first.record["bag"]}; expected one definition of a test; left out'
            notes.append(f'{file}: {text}')
        elif (same := trials.setdefault(bag.trial.model_dump_json(), bag)) is not bag:
            notes.append(f'{file}: the same trial as {same.record["bag"]}; expected each once; left out')
    if not trials:
        for note in notes[:-1]:
            log.warning('%s', note)
        raise ConfigError(notes[-1])
    found, varied = list(trials.values()), []
    for key in KEPT_APART:
        values = sorted({str(getattr(bag.trial, key)) for bag in found})
        if len(values) > 1:
            varied.append(key)
            text = f'{key} is {" or ".join(values)}; trials with different values are not pooled'
            notes.append(f'{found[0].record["bag"]} and others: {text}')
    records = [{**bag.record, **{key: str(getattr(bag.trial, key)) for key in varied}} for bag in found]
    title = paths[0].resolve().stem if len(paths) == 1 else f'{len(found)} trials'
    requested = {bag.trial.test.name: bag.trial for bag in found[::-1]}
    robot = RobotGeometry(found[0].trial.wheel_diameter.mean, found[0].trial.wheel_separation)
    return Results(results_table.trials_table(records, varied), varied, title, notes, {}, None, robot, requested)


def read_bag_trials(paths: Sequence[Path]) -> List[Union[TrialOfBag, str]]:
    """Read bags on all cores; return for each bag its trial or the reason why it is invalid."""
    workers = min(usable_cores(), len(paths))
    if workers < 2:
        return [_trial_or_reason(path) for path in paths]
    # Forked processes start fast and do not run the main script again.
    with ProcessPoolExecutor(workers, multiprocessing.get_context('fork')) as pool:
        with interrupts_blocked():  # the forked processes end with this one
            read = pool.map(_trial_or_reason, paths, chunksize=BAGS_PER_TASK)
        return list(read)


def _trial_or_reason(path: Path) -> Union[TrialOfBag, str]:
    """Read and analyse a bag; return a reason if it contains no trial, no /odom or no /world_pose."""
    try:
        recording = read_trial(path)
    except ConfigError as error:
        return str(error)
    odometry_topic = recording.trial.odometry_topic
    for topic in (odometry_topic, topics.WORLD_POSE):
        if topic not in recording.poses:
            return f'{path}: no message on {topic}; expected {POSE_TOPICS[topic]}'
    trial, goal = recording.trial, recording.trial.goal()
    errors: FinalErrors = {}
    of_source = {**TOPIC_OF_SOURCE, PoseSource.ODOM: odometry_topic}.items()
    poses = {source: recording.poses[topic] for source, topic in of_source if topic in recording.poses}
    start, (stamps_ns, odom) = trial.test.start.pose(), poses[PoseSource.ODOM][:2]
    yaws_rad = wrap_angles(start.yaw_rad + odom[:, 2])
    poses[PoseSource.ODOM] = PoseSeries(stamps_ns, np.column_stack((transform_points(start, odom[:, :2]), yaws_rad)))
    for source, series in poses.items() if recording.outcome is not Outcome.TORN else ():
        x_m, y_m, yaw_rad = series.x_y_yaw[-1].tolist()
        errors[source] = Pose2D(x_m - goal.x_m, y_m - goal.y_m, wrap_angle(yaw_rad - goal.yaw_rad))
    truth = poses[PoseSource.WORLD]
    record: Dict[str, Any] = {
        'test': trial.test.name,
        'ppr': IDEAL if trial.odom == 'ideal' else trial.encoder_label,
        'trial': trial.number,
        'seed': trial.number,
        'outcome': recording.outcome.value,
        'reason': recording.reason,
        'duration_s': float(truth.stamps_ns.max() - truth.stamps_ns.min()) / NANOSECONDS_PER_SECOND,
        'distance_m': truth.path_length_m(),
        'bag': str(recording.path),
        'true_path': _thinned(truth),
        'odom_path': _thinned(poses[PoseSource.ODOM]),
        **results_table.error_columns(errors),
    }
    for source, alignment in results_table.ALIGNMENTS.items():
        found = path_error(poses[source], truth, alignment) if source in poses else None
        if found is not None:
            record.update({f'{source.value}_{name}': getattr(found, name) for name in results_table.OF_PATH})
            for name, pairs, distance_m in results_table.RPES:
                of_segments = found.rpe[pairs][distance_m]._asdict()
                record.update({f'{source.value}_{name}_{part}': value for part, value in of_segments.items()})
    return TrialOfBag(trial, record)


def _thinned(series: PoseSeries) -> np.ndarray:
    """Return (n, 2) evenly spaced points [m], including both ends."""
    indices = np.linspace(0, len(series.x_y_yaw) - 1, results_table.MOST_POINTS).round().astype(int)
    return np.asarray(series.x_y_yaw[np.unique(indices), :2])
