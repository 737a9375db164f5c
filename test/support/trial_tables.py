"""Tables of results that are made of chosen or Gaussian final errors."""

import itertools
import math
import zlib

import numpy as np

from diff_encoder_sim.analysis.results_table import Results, RobotGeometry, trials_table
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial
from places import CONFIG

ALTO = RobotGeometry(0.2, 0.4)

# Final errors (x [m], y [m], yaw [deg]): within the tolerance, beyond it in position, and in heading.
IN, OUT, TURNED = (0.01, -0.02, 1.0), (0.01, 0.3, 1.0), (0.01, -0.02, 4.0)

POSES = ('odom', 'amcl', 'global', 'world')


def trial(test, ppr, number=1, outcome='succeeded', **columns):
    """A trial with final errors (x [m], y [m], yaw [deg]) by pose; other columns, and varied parameters, by name."""
    row = dict(test=test, ppr=ppr, trial=number, seed=number, outcome=outcome, reason='', duration_s=60.0)
    row.update(distance_m=20.0, wall_time_s=1.0, **{f'{pose}_x_m': math.nan for pose in POSES})
    for name, value in columns.items():
        if name not in POSES:
            row[name] = value
        elif value is not None:
            row.update({f'{name}_x_m': value[0], f'{name}_y_m': value[1], f'{name}_yaw_rad': math.radians(value[2])})
    return row


def cell(test, ppr, pose, errors, **columns):
    """Trials 1, 2, ... whose errors of one pose are given."""
    return [trial(test, ppr, number, **{pose: error}, **columns) for number, error in enumerate(errors, start=1)]


def rows(inside, outside):
    """As many final errors within the tolerance, and beyond it."""
    return [IN] * inside + [OUT] * outside


def both(test, ppr, world, odom, **columns):
    """A cell whose poses are (inside, outside)."""
    return [
        trial(test, ppr, number, world=true, odom=estimated, **columns)
        for number, (true, estimated) in enumerate(zip(rows(*world), rows(*odom)), start=1)
    ]


def results_of(*cells, varied=(), **changes):
    """Results of lists of trials; `varied` names the columns of varied parameters."""
    trials = trials_table([one for of_cell in cells for one in of_cell], list(varied))
    return Results(trials, list(varied), 'made for a test', [], {}, None, ALTO, {})._replace(**changes)


def navigated(test):
    """A test of the package as the paper drives it."""
    return Trial(test=load_test(test, CONFIG), nav='embedded')


def paper_results(*cells):
    """Results of the paper's tests, as the paper has them."""
    return results_of(*cells, requested={test: navigated(test) for test in ('SL', 'SMT', 'DLD')})


def synthetic_results(tests=('SL', 'SMT', 'DLD'), pprs=('40', '90', '1024', '4096'), trials=30, noises=()):
    """Odometry that spreads by whole pulses, and a truth that does not depend on the encoder."""
    made = []
    for test, noise, ppr, number in itertools.product(tests, noises or [None], pprs, range(1, trials + 1)):
        rng = np.random.default_rng([number, zlib.crc32(f'{test} {ppr}'.encode())])
        pulses = 40.0 / float(ppr) if ppr.isdigit() else 0.0
        truth = rng.normal(0.0, [0.015, 0.01, 0.7])
        odometry = truth + rng.normal(0.0, 1.0, 3) * pulses * [0.01, 0.3, 1.3]
        estimate = truth + rng.normal(0.0, [0.005, 0.005, 0.3])
        poses = {'odom': odometry, 'world': truth, 'amcl': estimate, 'global': estimate}
        made.append(trial(test, ppr, number, noise=noise, **poses))
    return results_of(made, varied=['noise'] if noises else [])


def column(table, name, key='statistic'):
    return dict(zip(table.exact[key], table.exact[name]))
