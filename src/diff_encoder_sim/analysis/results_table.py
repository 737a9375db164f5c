"""The results of trials as one table, which all statistics, tables, figures and reports are functions of.

`Results.trials` is a pandas DataFrame with a row for each trial: the tests of the paper first, then by varied
parameters in the order of their appearance, encoders ascending, trials by number. The index counts from 0. Its columns:

- `test`, `ppr`: name of the test, label of the encoder.
- one for each of `Results.varied`: value of a varied parameter, as text; `variant` is the name of a set of values.
- `trial`, `seed`: number of the trial; trials of equal number in other cells have equal random draws: they are pairs.
- `outcome`, `reason`: value of `Outcome`; reason of a failure.
- `duration_s`, `distance_m`, `wall_time_s`: simulated time, length of the true path, time to compute (NaN for bags).
- `odom_x_m`, `odom_y_m`, `odom_yaw_rad`: final /odom minus the goal along the map's axes; NaN without one, or if torn.
- `amcl_*`, `global_*`, `world_*`: the same of /amcl_pose, /global_pose, /world_pose.
- `odom_minus_world_*`: final /odom minus final /world_pose: the odometry's own error.
- `bag`: path of the bag, as text; '' if there is none, or it could not be read.
- `setup`: the test with its varied parameters, as tables show it: `SL, noise 0.03`.
- `cell`: the same with the encoder: `SL, 90 PPR, noise 0.03`; trials of a cell differ in their seed only.
- `odom_ate_rmse_m`, `odom_ate_max_m`, `odom_yaw_rmse_rad`: over the whole path; NaN without a bag; also `amcl_*`,
  `global_*`.
- `odom_rpe_1m_segments`, `odom_rpe_1m_translation_rmse_m`, `odom_rpe_1m_rotation_rmse_rad`: of each of `RPES`.
- `true_path`, `odom_path`: (n, 2) arrays [m] in the map frame, at most `MOST_POINTS`; None without a bag.

`trials.groupby('cell', sort=False)` are the cells in the order of all tables, `groupby('setup', sort=False)` the tests.
"""

from __future__ import annotations

import json
import logging
import math
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import IDEAL, ppr_order, ppr_text
from diff_encoder_sim.analysis.quantities import MINUS_TRUTH, QUANTITIES, Quantity
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.processes import interrupts_blocked, usable_cores
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries, wrap_angle, wrap_angles
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import bags_in
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, Alignment, RpePairs, path_error, rpe_name
from diff_encoder_sim.drives.trial_definition import FinalErrors, Outcome, Trial
from diff_encoder_sim.drives.trial_recording import POSE_TOPICS, TrialRecording, read_trial
from diff_encoder_sim.trials.trials_csv import BAGS, MANIFEST, PARTS, TABLE, VARIANT, TrialRow, TrialsTable, header

log = logging.getLogger(__name__)

# The paper's tests, first in every table; others follow.
STANDARD_TESTS = ('SL', 'SMT', 'DLD')

# Of a trial: metres, radians or seconds. Squares of larger numbers spoil every table.
LARGEST_NUMBER = 1e9

MOST_POINTS = 600  # of a path
SUCCEEDED = Outcome.SUCCEEDED.value
BAGS_PER_TASK = 4  # sent to a process at a time: enough to make the overhead negligible

# Odometry begins anywhere; the other sources estimate the pose in the map.
ALIGNMENTS = {PoseSource.ODOM: Alignment.ORIGIN, PoseSource.AMCL: Alignment.NONE, PoseSource.GLOBAL: Alignment.NONE}
RPES = [(rpe_name(pairs, distance_m), pairs, distance_m) for distance_m in RPE_DISTANCES_M for pairs in RpePairs]
_OF_PATH = ('ate_rmse_m', 'ate_max_m', 'yaw_rmse_rad')
_OF_SEGMENTS = ('segments', 'translation_rmse_m', 'rotation_rmse_rad')
PATH_COLUMNS = [
    *(
        f'{source.value}_{name}'
        for source in ALIGNMENTS
        for name in (*_OF_PATH, *(f'{rpe}_{part}' for rpe, _, _ in RPES for part in _OF_SEGMENTS))
    ),
    'true_path',
    'odom_path',
]

# Bags that differ in one of these are not pooled: it becomes a varied parameter.
KEPT_APART = ('nav', VARIANT, 'wheel_diameter', 'wheel_separation')


class RobotGeometry(NamedTuple):
    """The wheel geometry that odometry computes with."""

    wheel_diameter_m: float
    wheel_separation_m: float


class Results(NamedTuple):
    """The table of all trials, and what they have in common."""

    trials: pd.DataFrame  # see the module
    varied: List[str]  # columns of `trials`
    title: str
    notes: List[str]  # what could not be analysed and why, a line each
    manifest: Dict[str, Any]  # of a campaign; {} for bags
    folder: Optional[Path]  # of a campaign
    robot: RobotGeometry  # of the first trial, if a campaign varies it
    requested: Dict[str, Trial]  # the definition of one trial of each test


def load_results(paths: Sequence[Path]) -> Results:
    """Read a campaign's folder, or bags of trials and folders of such bags.

    Anything that cannot be analysed is left out, with a warning and a note.

    Raises:
        ConfigError: nothing can be analysed, or a campaign's folder is among other paths.
    """
    campaigns = [path for path in paths if path.is_dir() and (path / MANIFEST).is_file()]
    if campaigns and len(paths) > 1:
        raise ConfigError(f"{campaigns[0]}: a campaign's folder; expected it alone, or bags")
    results = read_campaign(campaigns[0]) if campaigns else read_bags(paths)
    for note in results.notes:
        log.warning('%s', note)
    return results


def trials_table(records: Iterable[Dict[str, Any]], varied: Sequence[str] = ()) -> pd.DataFrame:
    """Build the sorted table of all trials from a mapping of columns for each; columns left out have no value."""
    names = [name for name in header(varied) if name != 'bag']
    trials = pd.DataFrame([{'bag': '', 'true_path': None, 'odom_path': None, **each} for each in records])
    trials = trials.reindex(columns=[*names, 'bag', *PATH_COLUMNS])
    own = {part: trials[f'odom_{part}'] - trials[f'world_{part}'] for part in PARTS}
    own['yaw_rad'] = wrap_angles(own['yaw_rad'])
    trials = trials.assign(**{f'{MINUS_TRUTH}_{part}': values for part, values in own.items()})
    parameters = [varied_texts(values, varied) for values in trials[list(varied)].values.tolist()]
    trials['setup'] = [', '.join([test, *texts]) for test, texts in zip(trials['test'], parameters)]
    named = zip(trials['test'], map(ppr_text, trials['ppr']), parameters)
    trials['cell'] = [', '.join([test, encoder, *texts]) for test, encoder, texts in named]
    tests = list(dict.fromkeys([*STANDARD_TESTS, *trials['test']]))
    by_appearance = {values: rank for rank, values in enumerate(dict.fromkeys(map(tuple, parameters)))}
    order = [
        (tests.index(test), by_appearance[tuple(texts)], ppr_order(ppr), number)
        for test, texts, ppr, number in zip(trials['test'], parameters, trials['ppr'], trials['trial'])
    ]
    return trials.iloc[sorted(range(len(order)), key=order.__getitem__)].reset_index(drop=True)


def encoders(trials: pd.DataFrame) -> List[str]:
    """Return the labels of all encoders, ascending."""
    return sorted(trials['ppr'].unique(), key=ppr_order)


def varied_texts(values: Sequence[str], varied: Sequence[str]) -> List[str]:
    """Return each varied parameter with its value; the name of a variant stands alone."""
    return [value if key == VARIANT else f'{key} {value}' for key, value in zip(varied, values)]


def final_errors(trials: pd.DataFrame, pose: str, quantity: Quantity) -> np.ndarray:
    """(n,) errors of the trials that have this final pose, in the quantity's unit; `pose` is of `POSES`."""
    errors: np.ndarray = quantity.scale * trials[quantity.column(pose)].dropna().to_numpy(dtype=float)
    return errors


def record_of(row: TrialRow) -> Dict[str, Any]:
    """Return a line of trials.csv by the columns of the table; `bag` is below the campaign's folder."""
    record = {**row._asdict(), **dict(row.varied), **_final_errors(row.errors), 'outcome': row.outcome.value}
    del record['varied'], record['errors']
    return record


def _final_errors(errors: FinalErrors) -> Dict[str, float]:
    return {
        f'{source.value}_{part}': value
        for source in PoseSource
        for part, value in zip(PARTS, errors.get(source) or (math.nan,) * len(PARTS))
    }


def read_campaign(folder: Path) -> Results:
    """Read a campaign's folder; some or all bags may be missing.

    Raises:
        ConfigError: no trial is finished, or a file is missing or not as the campaign wrote it.
    """
    manifest, requested, robots, varied, expected = _manifest(folder / MANIFEST)
    rows, notes = _rows(folder / TABLE, varied, requested)
    if len(rows) < expected:
        text = f'has {len(rows)} of {expected} trials; the same campaign command runs the others'
        notes.append(f'{folder / TABLE}: {text}')
    if not rows:
        raise ConfigError(f'{folder}: no trial is finished; expected at least one')
    records: List[Dict[str, Any]] = [{**record_of(row), 'bag': ''} for row in rows]
    bags = {index: folder / row.bag for index, row in enumerate(rows) if row.bag and (folder / row.bag).is_file()}
    if len(bags) < len(rows):
        text = f'has bags of {len(bags)} of {len(rows)} trials; the others have no errors along the path'
        notes.append(f'{folder / BAGS}: {text}')
    for index, bag in zip(bags, read_bag_trials(list(bags.values()))):
        differing = [] if isinstance(bag, str) else _differing(bag, rows[index], requested[rows[index].test], robots)
        if isinstance(bag, str):
            notes.append(bag)
        elif differing:
            text = f'differs in {", ".join(differing)} from its line in trials.csv; expected the same trial'
            notes.append(f'{bag.record["bag"]}: {text}')
        else:
            records[index].update({name: bag.record[name] for name in ('bag', *PATH_COLUMNS) if name in bag.record})
    return Results(
        trials_table(records, varied), varied, manifest['name'], notes, manifest, folder, robots[0], requested
    )


def _manifest(path: Path) -> Tuple[Dict[str, Any], Dict[str, Trial], List[RobotGeometry], List[str], int]:
    """Return the manifest, a trial of each test, the robot of each set of parameters, varied keys, number of trials."""
    try:
        manifest = json.loads(path.read_text(encoding='utf-8'))
        configuration = {'encoders': [], **manifest['configuration']}
        tests = [{key: test[key] for key in test if key != 'files'} for test in configuration['tests']]
        trials = [Trial.from_mapping({'nav': configuration['nav'], 'test': test}, str(path)) for test in tests]
        wheels = [each['odometry'] for each in configuration['parameters']]
        robots = [RobotGeometry(float(each['wheel_diameter']), float(each['wheel_separation'])) for each in wheels]
        encoders = len(configuration['ppr']) + len(configuration['encoders'])
        count = len(tests) * len(robots) * encoders * int(configuration['trials'])
        varied = sorted(configuration['parameters'][0]['varied'])
        return (
            {**manifest, 'name': str(manifest['name'])},
            {trial.test.name: trial for trial in trials},
            robots,
            varied,
            count,
        )
    except (KeyError, IndexError, TypeError, AttributeError, json.JSONDecodeError, UnicodeDecodeError):
        raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it') from None
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None


def _rows(path: Path, varied: Sequence[str], tests: Iterable[str]) -> Tuple[List[TrialRow], List[str]]:
    """Return the lines of trials.csv, and a note if the last one is incomplete."""
    table, rows = TrialsTable(path, varied), {}
    try:
        is_torn = not path.read_bytes().endswith(b'\n')
        for number, row in table.rows():
            errors = [value for error in row.errors.values() for value in error or ()]
            is_plain = all(abs(value) <= LARGEST_NUMBER for value in (row.duration_s, row.distance_m, *errors))
            if row.test not in tests or row.identity() in rows or not is_plain:
                raise table.foreign_line(number)
            rows[row.identity()] = row
    except OSError as error:
        text = f'cannot be read: {error.strerror}; expected a folder that campaign wrote, or bags'
        raise ConfigError(f'{path}: {text}') from None
    return list(rows.values()), [f'{path}: the last line is incomplete; its trial is left out'] if is_torn else []


class TrialOfBag(NamedTuple):
    """A trial from its bag."""

    trial: Trial  # its definition
    record: Dict[str, Any]  # its results, by the columns of the table


def _differing(bag: TrialOfBag, row: TrialRow, requested: Trial, robots: Sequence[RobotGeometry]) -> List[str]:
    """Return the keys in which a bag's trial differs from its line in trials.csv."""
    recorded = bag.trial
    is_equal = {
        'test': recorded.test == requested.test,
        'number': recorded.number == row.seed,
        'nav': recorded.nav == requested.nav,
        'ppr': recorded.encoder_label == row.ppr,
        VARIANT: recorded.variant == dict(row.varied).get(VARIANT, ''),
        'wheel_diameter, wheel_separation': robot_of(recorded) in robots,
    }
    return [key for key, is_same in is_equal.items() if not is_same]


def read_bags(paths: Sequence[Path]) -> Results:
    """Read bags, and folders of bags.

    Raises:
        ConfigError: there is none that can be analysed, or a folder contains a campaign.
    """
    read = read_bag_trials(_bags_in(paths))
    notes = [bag for bag in read if isinstance(bag, str)]
    found = _distinct([bag for bag in read if not isinstance(bag, str)], notes)
    if not found:
        for note in notes[:-1]:
            log.warning('%s', note)
        raise ConfigError(notes[-1])
    varied = []
    for key in KEPT_APART:
        values = sorted({str(getattr(bag.trial, key)) for bag in found})
        if len(values) > 1:
            varied.append(key)
            text = f'{key} is {" or ".join(values)}; trials with different values are not pooled'
            notes.append(f'{found[0].record["bag"]} and others: {text}')
    records = [{**bag.record, **{key: str(getattr(bag.trial, key)) for key in varied}} for bag in found]
    title = paths[0].resolve().stem if len(paths) == 1 else f'{len(found)} trials'
    requested = {bag.trial.test.name: bag.trial for bag in found[::-1]}
    return Results(trials_table(records, varied), varied, title, notes, {}, None, robot_of(found[0].trial), requested)


def _bags_in(paths: Sequence[Path]) -> List[Path]:
    """Return the given bags, and those in the given folders.

    Raises:
        ConfigError: a folder contains no bag, or a campaign in a folder below it.
    """
    bags: List[Path] = []
    for path in paths:
        found = bags_in(path) if path.is_dir() else [path]
        campaigns = sorted(file.parent for file in path.rglob(MANIFEST)) if path.is_dir() else []
        if campaigns:
            raise ConfigError(f'{path}: holds the results of a campaign in {campaigns[0]}; expected that folder')
        if not found:
            raise ConfigError(f"{path}: no bag in this folder, and no campaign's results")
        bags += found
    return bags


def _distinct(bags: Sequence[TrialOfBag], notes: List[str]) -> List[TrialOfBag]:
    """Keep each trial once, and one definition of each test; add a note on each bag that is left out."""
    tests: Dict[str, TrialOfBag] = {}
    trials: Dict[str, TrialOfBag] = {}
    for bag in bags:
        name = bag.trial.test.name
        of_test = tests.setdefault(name, bag)
        if bag.trial.test != of_test.trial.test:
            text = f'defines {name} differently from {of_test.record["bag"]}; expected one definition of a test'
            notes.append(f'{bag.record["bag"]}: {text}; left out')
            continue
        same = trials.setdefault(bag.trial.model_dump_json(), bag)
        if same is not bag:
            text = f'the same trial as {same.record["bag"]}; expected each once; left out'
            notes.append(f'{bag.record["bag"]}: {text}')
    return list(trials.values())


def read_bag_trials(paths: Sequence[Path]) -> List[Union[TrialOfBag, str]]:
    """Read each bag on all cores; return its trial, or a line with the reason why it cannot be analysed."""
    workers = min(usable_cores(), len(paths))
    if workers < 2:
        return [_trial_or_reason(path) for path in paths]
    # Forked: starts at once, and does not run the main script again.
    with ProcessPoolExecutor(workers, multiprocessing.get_context('fork')) as pool:
        with interrupts_blocked():  # in the forked processes: they end with this one
            read = pool.map(_trial_or_reason, paths, chunksize=BAGS_PER_TASK)
        return list(read)


def _trial_or_reason(path: Path) -> Union[TrialOfBag, str]:
    try:
        return read_bag_trial(path)
    except ConfigError as error:
        return str(error)


def read_bag_trial(path: Path) -> TrialOfBag:
    """Read and analyse a bag.

    Raises:
        ConfigError: it is no readable bag of a trial, or lacks /odom or /world_pose.
    """
    recording = read_trial(path)
    for topic in (topics.ODOM, topics.WORLD_POSE):
        if topic not in recording.poses:
            raise ConfigError(f'{path}: no message on {topic}; expected {POSE_TOPICS[topic]}')
    trial, poses = recording.trial, poses_in_map(recording)
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
        **(_final_errors({} if recording.outcome is Outcome.TORN else goal_errors(recording))),
    }
    for source, alignment in ALIGNMENTS.items():
        error = path_error(poses[source], truth, alignment) if source in poses else None
        if error is not None:
            record.update({f'{source.value}_{name}': getattr(error, name) for name in _OF_PATH})
            for name, pairs, distance_m in RPES:
                of_segments = error.rpe[pairs][distance_m]._asdict()
                record.update({f'{source.value}_{name}_{part}': value for part, value in of_segments.items()})
    return TrialOfBag(trial, record)


def robot_of(trial: Trial) -> RobotGeometry:
    """Return the wheel geometry that the trial's odometry computes with."""
    return RobotGeometry(trial.wheel_diameter, trial.wheel_separation)


def goal_errors(recording: TrialRecording) -> FinalErrors:
    """Return the last pose of each source minus the goal, as campaigns write it to trials.csv."""
    errors: FinalErrors = dict.fromkeys(PoseSource)
    goal = recording.trial.goal()
    for source, series in poses_in_map(recording).items():
        x_m, y_m, yaw_rad = series.x_y_yaw[-1].tolist()
        errors[source] = Pose2D(x_m - goal.x_m, y_m - goal.y_m, wrap_angle(yaw_rad - goal.yaw_rad))
    return errors


def poses_in_map(recording: TrialRecording) -> Dict[PoseSource, PoseSeries]:
    """Return the pose series in the map frame; odometry starts at the surveyed start pose of the test."""
    poses = {source: recording.poses[topic] for source, topic in TOPIC_OF_SOURCE.items() if topic in recording.poses}
    if PoseSource.ODOM in poses:
        start, (x_m, y_m, yaw_rad) = recording.trial.test.start.pose(), poses[PoseSource.ODOM].x_y_yaw.T
        cos_yaw, sin_yaw = math.cos(start.yaw_rad), math.sin(start.yaw_rad)
        in_map = (
            start.x_m + cos_yaw * x_m - sin_yaw * y_m,
            start.y_m + sin_yaw * x_m + cos_yaw * y_m,
            wrap_angles(start.yaw_rad + yaw_rad),
        )
        poses[PoseSource.ODOM] = PoseSeries(poses[PoseSource.ODOM].stamps_ns, np.column_stack(in_map))
    return poses


def _thinned(series: PoseSeries) -> np.ndarray:
    """(n, 2) evenly chosen points [m], both ends among them."""
    indices = np.linspace(0, len(series.x_y_yaw) - 1, MOST_POINTS).round().astype(int)
    points: np.ndarray = series.x_y_yaw[np.unique(indices), :2]
    return points


# Of more trials, some are shown one by one: the report stays below 5 MB.
MOST_SHOWN = 2000


def first_of_cells(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the first trials of each cell, equally many: `MOST_SHOWN` in all, or one of each cell.

    They have equal numbers in all cells, and are as good a sample as any: trials differ by seed only.
    """
    if len(trials) <= MOST_SHOWN:
        return trials
    return trials.groupby('cell', sort=False).head(max(1, MOST_SHOWN // trials['cell'].nunique()))


def sample_text(shown: pd.DataFrame, trials: pd.DataFrame) -> str:
    """Return which of the trials are shown; '' if all are."""
    if len(shown) == len(trials):
        return ''
    return f'The first {shown["cell"].value_counts().max()} trials of each cell, of {len(trials)}'


def equal_trials(first: pd.DataFrame, second: pd.DataFrame, pose: str) -> Tuple[pd.DataFrame, pd.DataFrame]:
    """Return the trials of equal number of two cells that both have this final pose, in the same order."""
    one, other = (
        part.dropna(subset=[f'{pose}_x_m']).drop_duplicates('trial', keep='last').set_index('trial', drop=False)
        for part in (first, second)
    )
    numbers = [number for number in one.index if number in other.index]
    return one.loc[numbers], other.loc[numbers]


def are_within(trials: pd.DataFrame, pose: str, quantities: Sequence[Quantity] = QUANTITIES) -> np.ndarray:
    """(n,) of the trials that have this final pose: whether it is within the tolerances of all quantities."""
    within = [np.abs(final_errors(trials, pose, quantity)) <= quantity.tolerance for quantity in quantities]
    is_within: np.ndarray = np.all(within, axis=0)
    return is_within
