#!/usr/bin/env python3
"""Fits the simulation's wheel errors to one row of the paper, y of /odom in SL at 4096 PPR: see
docs/adr/0012-calibration.md. Prints the `set:` part of config/campaigns/paper.yaml and, from trials
driven with the result, how well the row is met. About a minute of two cores."""

from __future__ import annotations

import math
import os
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
from bench import ALTO, CONFIG, ROOT, in_processes, minus, parser, plan_of, print_header, print_table
from scipy import stats
from scipy.optimize import minimize

from diff_encoder_sim.analysis.paper.comparison import TRIALS, load_paper_cells
from diff_encoder_sim.analysis.quantities import Y
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.robot_params import load_robot_config, override

# Its route is the paper's to the metre, and wheel errors make its y, not the stopping.
TEST, SOURCE, PPR, QUANTITY = 'SL', 'odom', 4096, Y

# Log10 of the slip noise and the radius difference in units of 1e-4: where the search begins.
SIMPLEX = np.array([[-8.0, 0.0], [-7.0, 0.0], [-7.5, 1.0]])
SETS = 2000  # of the paper's size, drawn for each statistic's spread

# How finely the paper gives SL's y: last digits [m], and one trial more or less.
RESOLUTION = {'min': 1e-3, 'max': 1e-3, 'std': 1e-3, 'pct_within': 100.0 / TRIALS}


class WheelErrors(NamedTuple):
    slip_noise: float  # [m^2/m]
    radius_difference: float  # right minus left, relative

    def overrides(self) -> Dict[str, float]:
        """As a campaign sets them, with two digits."""
        half = float(f'{0.5 * self.radius_difference:.1e}')
        values = {'left_radius_error': -half, 'right_radius_error': half, 'slip_noise': float(f'{self.slip_noise:.1e}')}
        return {f'simulator.wheel_errors.{name}': value for name, value in values.items()}


class Drive(NamedTuple):
    """A trial, and what wheel errors would do to its odometry, to first order."""

    error: np.ndarray  # (3,) final /odom minus goal: x [m], y [m], yaw [rad]
    by_radius: np.ndarray  # (3,) its change per unit of radius difference
    noise: np.ndarray  # (3, 3) covariance per unit of slip noise


def drive(job: Tuple[int, Dict[str, Any]]) -> Drive:
    seed, overrides = job
    plan = plan_of(TEST, PPR, seed)
    trial, params = plan.trial, override(load_robot_config(CONFIG), overrides)
    reports = list(LockstepTrial(plan, ALTO, params).run())
    truth = np.array([report.true_pose_in_map for report in reports])
    end = trial.test.start.pose().compose(reports[-1].odometry.base_pose_in_odom)
    return Drive(minus(end, trial.goal()), *sensitivities(truth, trial.wheel_separation))


def sensitivities(truth: np.ndarray, separation_m: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return how the final odometry changes when a wheel on the way seems to travel more than it does.

    Args:
        truth: (n, 3) true poses on the way, x [m], y [m], yaw [rad].

    Returns:
        `by_radius` and `noise` of a Drive.
    """
    steps = np.diff(truth, axis=0)
    turns_rad = (steps[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    middle = truth[:-1] + 0.5 * np.column_stack((steps[:, :2], turns_rad))
    cos_yaw, sin_yaw, ones = np.cos(middle[:, 2]), np.sin(middle[:, 2]), np.ones(len(steps))
    lengths_m = steps[:, 0] * cos_yaw + steps[:, 1] * sin_yaw
    # A metre more shifts the end; a radian more turns it about the robot's position at that time.
    by_length = np.column_stack((cos_yaw, sin_yaw, 0.0 * ones))
    by_heading = np.column_stack((middle[:, 1] - truth[-1, 1], truth[-1, 0] - middle[:, 0], ones))
    left_m, right_m = (lengths_m + side * 0.5 * separation_m * turns_rad for side in (-1.0, 1.0))
    by_left, by_right = (0.5 * by_length + side * by_heading / separation_m for side in (-1.0, 1.0))
    # A larger wheel turns less for the same way.
    by_radius = 0.5 * (left_m @ by_left - right_m @ by_right)
    noise = by_left.T @ (np.abs(left_m)[:, None] * by_left) + by_right.T @ (np.abs(right_m)[:, None] * by_right)
    return by_radius, noise


def fitted_row() -> List[Any]:
    """The paper's numbers that are fitted to."""
    of_row = (TEST, SOURCE, str(PPR), QUANTITY.name)
    cells = load_paper_cells().itertuples()
    return [cell for cell in cells if (cell.test, cell.source, cell.ppr, cell.quantity) == of_row]


class Fit:
    """How likely the paper's numbers are with given wheel errors.

    From the trials driven, sets of the paper's size are drawn and given slip; each statistic is
    then judged by its mean and spread over the sets, as if Gaussian and independent.
    """

    def __init__(self, drives: Sequence[Drive]) -> None:
        self._cells = fitted_row()
        rng = np.random.default_rng(0)
        chosen = rng.integers(len(drives), size=(SETS, TRIALS))
        of_y = QUANTITY.component
        self._errors_m = np.array([one.error[of_y] for one in drives])[chosen]
        self._by_radius_m = np.array([one.by_radius[of_y] for one in drives])[chosen]
        noise_m = np.sqrt([one.noise[of_y, of_y] for one in drives])[chosen]
        self._noise_m = noise_m * rng.standard_normal(chosen.shape)

    def misfit(self, errors: WheelErrors) -> float:
        """Minus twice the log likelihood, but for a constant."""
        y_m = self._errors_m + errors.radius_difference * self._by_radius_m
        y_m, total = y_m + math.sqrt(errors.slip_noise) * self._noise_m, 0.0
        for cell in self._cells:
            values = statistic(y_m, cell)
            variance = values.var() + RESOLUTION[cell.statistic] ** 2 / 12.0
            total += (cell.paper - values.mean()) ** 2 / variance + math.log(variance)
        return total

    def search(self) -> np.ndarray:
        options = {'initial_simplex': SIMPLEX}
        return minimize(lambda at: self.misfit(from_vector(at)), SIMPLEX[0], method='Nelder-Mead', options=options).x

    def interval(self, best: np.ndarray, component: int) -> Tuple[float, float]:
        """How far one component can go, the other held, by the 95 % of the likelihood ratio."""
        limit = self.misfit(from_vector(best)) + stats.chi2.ppf(0.95, 1)
        ends = best[component] + np.linspace(-2.0, 2.0, 401)
        moved = (np.where(np.arange(2) == component, end, best) for end in ends)
        inside = [end for end, vector in zip(ends, moved) if self.misfit(from_vector(vector)) <= limit]
        return min(inside), max(inside)


def from_vector(vector: Sequence[float]) -> WheelErrors:
    return WheelErrors(float(10.0 ** vector[0]), float(vector[1] * 1e-4))


def statistic(values: np.ndarray, cell: Any) -> np.ndarray:
    """The cell's statistic over the last axis of errors in the paper's unit."""
    if cell.statistic == 'pct_within':
        return 100.0 * np.mean(np.abs(values) <= QUANTITY.tolerance, axis=-1)
    if cell.statistic == 'std':
        return values.std(axis=-1, ddof=1)
    return values.min(axis=-1) if cell.statistic == 'min' else values.max(axis=-1)


def run_trials(trials: int, workers: int, overrides: Dict[str, Any]) -> List[Drive]:
    return in_processes(drive, [(seed, overrides) for seed in range(1, trials + 1)], workers)


def main() -> None:
    arguments = parser(__doc__, trials=30, workers=os.cpu_count()).parse_args()
    print_header(f'Wheel errors fitted to {QUANTITY.axis} of {SOURCE}, {TEST}, {PPR} PPR: {arguments.trials} trials')
    settings = load_campaign('paper', ROOT).params.overrides
    settings = {key: value for key, value in settings.items() if not key.startswith('simulator.wheel_errors.')}
    ideal = run_trials(arguments.trials, arguments.workers, settings)
    fit = Fit(ideal)
    best = fit.search()
    errors = from_vector(best)
    print('set:', *(f'  {key}: {value:.1e}' for key, value in errors.overrides().items()), sep='\n')
    slips, radii = fit.interval(best, 0), fit.interval(best, 1)
    print(
        f'\n95 % intervals: slip_noise {10 ** slips[0]:.1e} to {10 ** slips[1]:.1e}, radius '
        f'difference {1e-4 * radii[0]:.1e} to {1e-4 * radii[1]:.1e}\n',
        flush=True,
    )
    driven = run_trials(arguments.trials, arguments.workers, {**settings, **errors.overrides()})
    errors_m = [np.array([one.error[QUANTITY.component] for one in drives]) for drives in (ideal, driven)]
    rows = [[cell.statistic, cell.paper, *(f'{statistic(e, cell):.3f}' for e in errors_m)] for cell in fitted_row()]
    print_table(rows, [f'{QUANTITY.axis} [{QUANTITY.unit}]', 'paper', 'ideal wheels', 'fitted'])


if __name__ == '__main__':
    main()
