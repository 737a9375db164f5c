"""Reads trials from bags: everything is computed from the recordings."""

from __future__ import annotations

import logging
import math
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence, Union

import numpy as np

from diff_encoder_sim.analysis.dataset import Dataset, RobotGeometry, Tracks, TrialData
from diff_encoder_sim.analysis.encoder_labels import IDEAL
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.processes import interrupts_blocked, usable_cores
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import bags_in
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trajectory_error import Alignment, PathError, path_error
from diff_encoder_sim.drives.trial_definition import FinalErrors, Trial
from diff_encoder_sim.drives.trial_recording import POSE_TOPICS, TrialRecording, read_trial
from diff_encoder_sim.trials.campaign_cells import VARIANT
from diff_encoder_sim.trials.results import MANIFEST


def poses_in_map(recording: TrialRecording) -> Dict[PoseSource, PoseSeries]:
    """Return the pose series in the map frame; odometry starts at the surveyed start pose of the test."""
    poses = {source: recording.poses[topic] for source, topic in TOPIC_OF_SOURCE.items() if topic in recording.poses}
    if PoseSource.ODOM in poses:
        poses[PoseSource.ODOM] = composed(recording.trial.test.start.pose(), poses[PoseSource.ODOM])
    return poses


def goal_errors(recording: TrialRecording) -> FinalErrors:
    """Return the last pose of each source minus the goal, as campaigns write it to trials.csv."""
    errors: FinalErrors = dict.fromkeys(PoseSource)
    goal = recording.trial.goal()
    for source, series in poses_in_map(recording).items():
        x_m, y_m, yaw_rad = series.x_y_yaw[-1].tolist()
        errors[source] = Pose2D(x_m - goal.x_m, y_m - goal.y_m, wrap_angle(yaw_rad - goal.yaw_rad))
    return errors


def composed(frame: Pose2D, series: PoseSeries) -> PoseSeries:
    """Transform poses from a frame into its parent, given the frame's pose; yaw in [-pi, pi)."""
    cos_yaw, sin_yaw = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)
    x_m, y_m, yaw_rad = series.x_y_yaw.T
    return PoseSeries(
        series.stamps_ns,
        np.column_stack(
            (
                frame.x_m + cos_yaw * x_m - sin_yaw * y_m,
                frame.y_m + sin_yaw * x_m + cos_yaw * y_m,
                wrap_angle(frame.yaw_rad + yaw_rad),
            )
        ),
    )


# Sent to a worker at a time: enough to make the overhead negligible.
BAGS_PER_TASK = 4

MOST_POINTS = 600  # of a track

# Odometry begins anywhere; the other sources estimate the pose in the map.
ALIGNMENTS = {PoseSource.ODOM: Alignment.ORIGIN, PoseSource.AMCL: Alignment.NONE, PoseSource.GLOBAL: Alignment.NONE}


class BagTrial(NamedTuple):
    """A trial from its bag."""

    trial: Trial  # its definition
    data: TrialData  # its results; nothing is varied


def read_bag_trials(paths: Sequence[Path]) -> List[Union[BagTrial, str]]:
    """Read each bag on all cores; return its trial, or a line with the reason why it cannot be analysed."""
    workers = min(usable_cores(), len(paths))
    if workers < 2:
        return [_trial_or_reason(path) for path in paths]
    # Forked: starts at once, and does not run the main script again.
    with ProcessPoolExecutor(workers, multiprocessing.get_context('fork')) as pool:
        with interrupts_blocked():  # in the forked processes: they end with this one
            read = pool.map(_trial_or_reason, paths, chunksize=BAGS_PER_TASK)
        return list(read)


def read_bag_trial(path: Path) -> BagTrial:
    """Read and analyse a bag.

    Raises:
        ConfigError: it is no readable bag of a trial, or lacks /odom or /world_pose.
    """
    recording = read_trial(path)
    for topic in (topics.ODOM, topics.WORLD_POSE):
        if topic not in recording.poses:
            raise ConfigError(f'{path}: no message on {topic}; expected {POSE_TOPICS[topic]}')
    return BagTrial(recording.trial, _data(recording))


def _data(recording: TrialRecording) -> TrialData:
    trial, poses = recording.trial, poses_in_map(recording)
    truth = poses[PoseSource.WORLD]
    return TrialData(
        trial.test.name,
        label_of(trial),
        (),
        trial.number,
        trial.number,
        recording.outcome,
        recording.reason,
        float(truth.stamps_ns.max() - truth.stamps_ns.min()) / NANOSECONDS_PER_SECOND,
        truth.path_length_m(),
        goal_errors(recording),
        _path_errors(poses),
        _tracks(poses),
        recording.path,
    )


def label_of(trial: Trial) -> str:
    """Return the label of the trial's encoder."""
    return IDEAL if trial.odom == 'ideal' else trial.encoder_label


def robot_of(trial: Trial) -> RobotGeometry:
    """Return the wheel geometry that the trial's odometry computes with."""
    return RobotGeometry(trial.wheel_diameter, trial.wheel_separation)


def _trial_or_reason(path: Path) -> Union[BagTrial, str]:
    try:
        return read_bag_trial(path)
    except ConfigError as error:
        return str(error)


def _path_errors(poses: Dict[PoseSource, PoseSeries]) -> Dict[PoseSource, Optional[PathError]]:
    truth = poses[PoseSource.WORLD]
    return {
        source: path_error(poses[source], truth, ALIGNMENTS[source]) if source in poses else None
        for source in ALIGNMENTS
    }


def _tracks(poses: Dict[PoseSource, PoseSeries]) -> Tracks:
    return Tracks(*(_thinned(poses[source].x_y_yaw[:, :2]) for source in (PoseSource.WORLD, PoseSource.ODOM)))


def _thinned(points: np.ndarray) -> np.ndarray:
    indices = np.linspace(0, len(points) - 1, MOST_POINTS).round().astype(int)
    kept: np.ndarray = points[np.unique(indices)]
    return kept


log = logging.getLogger(__name__)

# Trials that differ in one of these are not pooled: it becomes a varied parameter.
KEPT_APART = ('nav', VARIANT, 'wheel_diameter', 'wheel_separation')


def bag_dataset(paths: Sequence[Path]) -> Dataset:
    """Read bags, and folders of bags.

    Raises:
        ConfigError: there is none that can be analysed, or a folder has a campaign in it.
    """
    read = read_bag_trials(_bags_in(paths))
    notes = [bag for bag in read if isinstance(bag, str)]
    found = _distinct([bag for bag in read if not isinstance(bag, str)], notes)
    if not found:
        for note in notes[:-1]:
            log.warning('%s', note)
        raise ConfigError(notes[-1])
    varied = _differences(found, notes)
    title = paths[0].resolve().stem if len(paths) == 1 else f'{len(found)} trials'
    return Dataset(
        title,
        [bag.data._replace(varied=tuple((key, str(getattr(bag.trial, key))) for key in varied)) for bag in found],
        notes,
        None,
        None,
        robot_of(found[0].trial),
        {bag.trial.test.name: bag.trial for bag in found[::-1]},
    )


def _bags_in(paths: Sequence[Path]) -> List[Path]:
    """Return the given bags, and those in the given folders.

    Raises:
        ConfigError: a folder has no bag in it, or a campaign further down.
    """
    bags: List[Path] = []
    for path in paths:
        if not path.is_dir():
            bags.append(path)
            continue
        campaigns = sorted(file.parent for file in path.rglob(MANIFEST))
        if campaigns:
            raise ConfigError(f'{path}: holds the results of a campaign in {campaigns[0]}; expected that folder')
        found = bags_in(path)
        if not found:
            raise ConfigError(f"{path}: no bag in this folder, and no campaign's results")
        bags += found
    return bags


def _distinct(bags: Sequence[BagTrial], notes: List[str]) -> List[BagTrial]:
    """Keep each trial once, and one definition of each test; add what is left out to `notes`."""
    first_of_test: Dict[str, BagTrial] = {}
    first_of_trial: Dict[str, BagTrial] = {}
    for bag in bags:
        test = first_of_test.setdefault(bag.trial.test.name, bag)
        same = first_of_trial.setdefault(bag.trial.model_dump_json(), bag)
        if bag.trial.test != test.trial.test:
            notes.append(
                f'{bag.data.bag}: defines {bag.trial.test.name} differently from {test.data.bag}; '
                f'expected one definition of a test; left out'
            )
        elif same is not bag:
            notes.append(f'{bag.data.bag}: the same trial as {same.data.bag}; expected each once; left out')
    return [bag for bag in first_of_trial.values() if bag.trial.test == first_of_test[bag.trial.test.name].trial.test]


def _differences(bags: Sequence[BagTrial], notes: List[str]) -> List[str]:
    """Return the keys of KEPT_APART in which trials differ, and add a note for each."""
    keys = []
    for key in KEPT_APART:
        values = sorted({str(getattr(bag.trial, key)) for bag in bags})
        if len(values) > 1:
            keys.append(key)
            notes.append(
                f'{bags[0].data.bag} and others: {key} is {" or ".join(values)}; trials with '
                f'different values are not pooled'
            )
    return keys
