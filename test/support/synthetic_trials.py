"""Datasets of Gaussian errors, for tests of what is made of a dataset."""

import math
import zlib

import numpy as np

from diff_encoder_sim.analysis.dataset import Dataset, RobotGeometry, TrialData
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome

ALTO = RobotGeometry(0.2, 0.4)

DEG = math.pi / 180.0
# x [m], y [m], yaw: of three trials; within 0.05 m: 2 and 1 of them; within 3 degrees: 2.
HAND_ERRORS = [(0.00, 0.10, 1.0 * DEG), (0.03, -0.10, -2.0 * DEG), (-0.06, 0.00, 4.0 * DEG)]


def trial_data(test='SL', ppr='90', number=1, errors=(0.0, 0.0, 0.0), **other):
    """One trial; `errors` of all sources alike, or by source."""
    if not isinstance(errors, dict):
        errors = dict.fromkeys(PoseSource, errors)
    errors = {source: error and Pose2D(*error) for source, error in errors.items()}
    return TrialData(
        **{
            **dict(
                test=test,
                ppr=ppr,
                varied=(),
                trial=number,
                seed=number,
                outcome=Outcome.SUCCEEDED,
                reason='',
                duration_s=48.0,
                distance_m=20.0,
                errors=errors,
                paths={},
                tracks=None,
                bag=None,
            ),
            **other,
        }
    )


def dataset_of(trials, **other):
    return Dataset(
        **{
            **dict(
                title='synthetic', trials=list(trials), notes=[], manifest=None, folder=None, robot=ALTO, requested={}
            ),
            **other,
        }
    )


def hand_dataset():
    """Three trials of a cell, whose statistics are easily worked out."""
    return dataset_of(trial_data('SL', '90', number, errors) for number, errors in enumerate(HAND_ERRORS, 1))


def synthetic_dataset(tests=('SL', 'SMT', 'DLD'), pprs=('40', '90', '1024', '4096'), trials=30, variants=((),)):
    """Odometry that spreads as whole pulses let it, and a truth that does not depend on the encoder."""
    return dataset_of(
        _drawn_trial(test, ppr, varied, number)
        for test in tests
        for varied in variants
        for ppr in pprs
        for number in range(1, trials + 1)
    )


def _drawn_trial(test, ppr, varied, number):
    rng = np.random.default_rng([number, zlib.crc32(f'{test} {ppr}'.encode())])
    pulses = 40.0 / float(ppr) if ppr.isdigit() else 0.0
    truth = rng.normal(0.0, [0.015, 0.01, math.radians(0.7)])
    odometry = truth + rng.normal(0.0, 1.0, 3) * pulses * [0.01, 0.3, math.radians(1.3)]
    errors = {PoseSource.ODOM: odometry.tolist(), PoseSource.WORLD: truth.tolist()}
    errors[PoseSource.AMCL] = errors[PoseSource.GLOBAL] = (truth + rng.normal(0.0, 0.005, 3)).tolist()
    return trial_data(test, ppr, number, errors, varied=varied)
