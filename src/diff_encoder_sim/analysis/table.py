"""The first table: each trial's odometry error beside the closed form."""
from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Sequence

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.analysis.errors import OdometryError, goal_errors
from diff_encoder_sim.encoder import ppr_label
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.reading import TrialRecording
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND

UNITS = np.array([1.0, 1.0, 180.0 / math.pi])  # errors are shown in m, m, degrees


class AnalysedTrial(NamedTuple):
    """A recording and what came out of it."""

    recording: TrialRecording
    error: OdometryError


def trial_table(trials: Sequence[AnalysedTrial]) -> str:
    """One row a trial: the error of /odom at the end, and one sigma of its closed form."""
    headers = ['test', 'PPR', 'trial', 'outcome', 'path\n[m]', 'turned\n[deg]',
               'x error\n[m]', 'y error\n[m]', 'yaw error\n[deg]',
               'sigma x\n[m]', 'sigma y\n[m]', 'sigma yaw\n[deg]', 'RMSE xy\n[m]']
    rows = [[recording.trial.test.name, ppr_name(recording), recording.trial.number,
             recording.outcome, f'{error.path_length_m:.2f}',
             f'{math.degrees(error.true_turn_rad):.1f}',
             *(_signed(value) for value in error.end_error * UNITS),
             *(f'{value:.4f}' for value in error.quantisation_std * UNITS),
             f'{error.position_rmse_m:.4f}'] for recording, error in trials]
    return tabulate(rows, headers, disable_numparse=True, stralign='right')


def goal_table(trials: Sequence[AnalysedTrial]) -> str:
    """One row a trial: where each source says that it ended, minus the goal."""
    sources = (topics.ODOM, topics.AMCL_POSE, topics.GLOBAL_POSE, topics.WORLD_POSE)
    headers = ['test', 'PPR', 'trial', 'seconds',
               *(f'{source}\n{unit}' for source in sources for unit in ('[m]', '[deg]'))]
    rows = []
    for recording, _ in trials:
        errors = goal_errors(recording)
        row = [recording.trial.test.name, ppr_name(recording), recording.trial.number,
               f'{_duration_s(recording):.1f}']
        for source in sources:
            row += _distance_and_angle(errors.get(source))
        rows.append(row)
    return tabulate(rows, headers, disable_numparse=True, stralign='right')


def _duration_s(recording: TrialRecording) -> float:
    stamps_ns = recording.poses[topics.WORLD_POSE].stamps_ns
    return float(stamps_ns[-1] - stamps_ns[0]) / NANOSECONDS_PER_SECOND


def _distance_and_angle(error: Optional[np.ndarray]) -> List[str]:
    if error is None:
        return ['', '']
    x_m, y_m, yaw_deg = (error * UNITS).tolist()
    return [f'{math.hypot(x_m, y_m):.4f}', f'{yaw_deg:+.2f}']


def pooled_table(trials: Sequence[AnalysedTrial]) -> str:
    """One row a test and PPR that has several trials: spread of the raw errors, pooled."""
    cells: dict = {}
    for trial in trials:
        cells.setdefault((trial.recording.trial.test.name, ppr_name(trial.recording)),
                         []).append(trial.error)
    headers = ['test', 'PPR', 'trials', 'RMS x\n[m]', 'RMS y\n[m]', 'RMS yaw\n[deg]',
               'sigma x\n[m]', 'sigma y\n[m]', 'sigma yaw\n[deg]']
    rows = [[*cell, len(errors), *(f'{value:.4f}' for value in _rms(
                [error.end_error * UNITS for error in errors])),
             *(f'{value:.4f}' for value in _rms(
                 [error.quantisation_std * UNITS for error in errors]))]
            for cell, errors in cells.items() if len(errors) > 1]
    return tabulate(rows, headers, disable_numparse=True, stralign='right') if rows else ''


def ppr_name(recording: TrialRecording) -> str:
    """The encoder of a trial in a word."""
    trial = recording.trial
    return 'ideal' if trial.odom == 'ideal' else ppr_label(trial.ppr)


def _rms(rows: List[np.ndarray]) -> np.ndarray:
    return np.sqrt(np.mean(np.square(rows), axis=0))


def _signed(value: float) -> str:
    return f'{value:+.4f}'
