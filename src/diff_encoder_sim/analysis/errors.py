"""How far odometry is from the truth, beside what the encoder's resolution alone explains."""
from __future__ import annotations

import math
from typing import Dict, NamedTuple

import numpy as np

from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.experiments.definition import Trial
from diff_encoder_sim.odometry import quantisation_covariance
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.reading import PoseSeries, TrialRecording
from diff_encoder_sim.se2 import Pose2D


class OdometryError(NamedTuple):
    """Odometry minus truth in one trial; axes are those of the start pose."""

    end_error: np.ndarray        # (3,) x [m], y [m], yaw [rad] at the last common stamp
    quantisation_std: np.ndarray  # (3,) the closed form for it; zero for ideal odometry
    position_rmse_m: float       # over the whole path
    path_length_m: float         # true
    true_turn_rad: float         # true, whole turns counted


def odometry_error(recording: TrialRecording) -> OdometryError:
    """Compare /odom with /world_pose, both as seen from the start.

    Raises:
        ConfigError: a topic is missing, or the two have no stamp in common.
    """
    odom = _poses(recording, topics.ODOM)
    truth = _poses(recording, topics.WORLD_POSE)
    _, odom_rows, truth_rows = np.intersect1d(odom.stamps_ns, truth.stamps_ns,
                                              return_indices=True)
    if len(odom_rows) == 0:
        raise ConfigError(f'{recording.path}: {topics.ODOM} and {topics.WORLD_POSE} have no stamp '
                          f'in common')
    start = recording.trial.test.start.pose()
    true_x_y_yaw = relative_to(truth.x_y_yaw[truth_rows], start)
    errors = odom.x_y_yaw[odom_rows] - true_x_y_yaw
    errors[:, 2] = (errors[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    steps = np.diff(true_x_y_yaw, axis=0)
    turns_rad = (steps[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    return OdometryError(
        errors[-1], quantisation_std(recording.trial, Pose2D(*true_x_y_yaw[-1].tolist())),
        float(np.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2))),
        float(np.sum(np.hypot(steps[:, 0], steps[:, 1]))), float(np.sum(turns_rad)))


def goal_errors(recording: TrialRecording) -> Dict[str, np.ndarray]:
    """Of each pose topic, how far from the goal it says that the robot ended.

    (3,) x [m], y [m], yaw [rad] in the goal's frame, by topic; /odom is seen from the true start.
    Topics without a message are left out.

    Raises:
        ConfigError: a pose is not finite.
    """
    goal, errors = recording.trial.goal(), {}
    for topic in recording.poses:
        end_pose = Pose2D(*_poses(recording, topic).x_y_yaw[-1].tolist())
        if topic == topics.ODOM:
            end_pose = recording.trial.test.start.pose().compose(end_pose)
        errors[topic] = np.array(end_pose.relative_to(goal))
    return errors


def quantisation_std(trial: Trial, end_pose: Pose2D) -> np.ndarray:
    """(3,) standard deviation of the odometry error at `end_pose`, seen from the start.

    x [m], y [m], yaw [rad], over uniformly distributed wheel phases.
    """
    if trial.odom == 'ideal':
        return np.zeros(3)
    circumference_m = math.pi * trial.wheel_diameter
    return np.sqrt(np.diag(quantisation_covariance(
        end_pose, circumference_m / trial.ppr.left, circumference_m / trial.ppr.right,
        trial.wheel_separation)))


def relative_to(x_y_yaw: np.ndarray, reference: Pose2D) -> np.ndarray:
    """(n, 3) poses as seen from `reference`; yaw is not wrapped."""
    cos_yaw, sin_yaw = math.cos(reference.yaw_rad), math.sin(reference.yaw_rad)
    offset = x_y_yaw - np.array(reference)
    return np.column_stack((cos_yaw * offset[:, 0] + sin_yaw * offset[:, 1],
                            cos_yaw * offset[:, 1] - sin_yaw * offset[:, 0], offset[:, 2]))


def _poses(recording: TrialRecording, topic: str) -> PoseSeries:
    if topic not in recording.poses:
        raise ConfigError(f'{recording.path}: no message on {topic}')
    series = recording.poses[topic]
    if not np.isfinite(series.x_y_yaw).all():
        raise ConfigError(f'{recording.path}: {topic}: a pose is not finite')
    return series
