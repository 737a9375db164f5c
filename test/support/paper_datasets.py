"""Datasets made of chosen final errors, for the tests of what is compared with the paper."""

from __future__ import annotations

import math

from diff_encoder_sim.analysis.dataset import Dataset, RobotGeometry, TrialData
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome, Trial
from places import CONFIG

# Final errors (x [m], y [m], yaw [deg]): within the tolerance, beyond it in position, and in heading.
IN, OUT, TURNED = (0.01, -0.02, 1.0), (0.01, 0.3, 1.0), (0.01, -0.02, 4.0)


def trial(test, ppr, number, outcome=Outcome.SUCCEEDED, varied=(), **errors):
    """A trial with errors (x [m], y [m], yaw [deg]) by source; a source left out has none."""
    in_rad = dict.fromkeys(PoseSource)
    for source, error in errors.items():
        if error is not None:
            in_rad[PoseSource(source)] = Pose2D(error[0], error[1], math.radians(error[2]))
    return TrialData(
        test, ppr, varied, number, number, outcome, '', 60.0, 20.0, in_rad, dict.fromkeys(PoseSource), None, None
    )


def cell(test, ppr, source, rows, **others):
    """Trials 1, 2, ... whose errors of one source are `rows`."""
    return [trial(test, ppr, number, **{source: row}, **others) for number, row in enumerate(rows, start=1)]


def rows(inside, outside):
    """So many final errors within the tolerance, and so many beyond."""
    return [IN] * inside + [OUT] * outside


def both(test, ppr, world, odom, **others):
    """A cell whose sources are (inside, outside)."""
    return [
        trial(test, ppr, number, world=true, odom=estimated, **others)
        for number, (true, estimated) in enumerate(zip(rows(*world), rows(*odom)), start=1)
    ]


def navigated(test):
    """Return a test of the package as the paper drives it."""
    return Trial(test=load_test(test, CONFIG), nav='embedded')


def paper_dataset(*cells):
    """Return the dataset of lists of trials of the paper's tests, as the paper has them."""
    return dataset(*cells)._replace(requested={test: navigated(test) for test in ('SL', 'SMT', 'DLD')})


def dataset(*cells):
    """Return the dataset of lists of trials."""
    return Dataset(
        'made for a test',
        [trial for of_cell in cells for trial in of_cell],
        [],
        None,
        None,
        RobotGeometry(0.2, 0.4),
        {},
    )
