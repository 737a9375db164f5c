"""The wheels of a campaign for other ROS packages: with the smallest sufficient encoder, and its measured errors."""

from __future__ import annotations

from typing import Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import IDEAL, ppr_text
from diff_encoder_sim.analysis.quantities import MINUS_TRUTH, QUANTITIES
from diff_encoder_sim.analysis.results_table import Results, encoders, final_errors
from diff_encoder_sim.analysis.summaries import Sufficiency, fewest_trials, fractions_within
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, OdometryParams
from diff_encoder_sim.wheels.ros_parameters import RosWheels


def ros_wheels(results: Results) -> Optional[RosWheels]:
    """Return the wheels with the coarsest encoder whose odometry suffices in all tests, else with the finest one.

    Without wheel errors of the campaign they are exact. None if no trial has an encoder.
    """
    labels, fractions = [label for label in encoders(results.trials) if label != IDEAL], fractions_within(results)
    if not labels:
        return None
    is_enough = fractions['sufficiency'] == Sufficiency.YES.value
    of_odometry = is_enough[fractions['pose'] == MINUS_TRUTH].groupby(fractions['ppr']).all()
    label = next((each for each in labels if of_odometry[each]), labels[-1])
    left, *right = map(float, label.partition(' ')[0].split('-'))  # `40-90`: 40 left, 90 right
    trial = next(iter(results.requested.values()))
    known = {key: getattr(trial, key) for key in ('wheel_diameter', 'wheel_separation', *UNCERTAINTY_KEYS)}
    odometry = OdometryParams.from_mapping({**known, 'ppr': {'left': left, 'right': [left, *right][-1]}}, '')
    about = f'{results.title}, {ppr_text(label)}, wheels as simulated'
    return RosWheels(odometry, about, measured=_measured(results, label))


def _measured(results: Results, label: str) -> Optional[Tuple[Sequence[float], str]]:
    """Return the mean squares of the odometry error after the first test with enough trials, along the axes of odom."""
    for test, of_test in results.trials[results.trials['ppr'] == label].groupby('test', sort=False):
        errors = [final_errors(of_test, MINUS_TRUTH, quantity) / quantity.scale for quantity in QUANTITIES]
        if len(errors[0]) >= fewest_trials() and results.requested[test].test.start.yaw == 0.0:
            return [float(np.mean(each**2)) for each in errors], f'{test}, measured in {len(errors[0])} trials'
    return None
