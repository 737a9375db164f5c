"""Reads one trial from its bag: everything is computed from the recording."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence, Union

import numpy as np

from diff_encoder_sim.analysis.dataset import RobotGeometry, Tracks, TrialData
from diff_encoder_sim.analysis.encoder_labels import IDEAL
from diff_encoder_sim.analysis.goal_errors import goal_errors, poses_in_map
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.processes import interrupts_blocked, usable_cores
from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trajectory_error import Alignment, PathError, path_error
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_recording import POSE_TOPICS, TrialRecording, read_trial

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
