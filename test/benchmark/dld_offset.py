#!/usr/bin/env python3
"""Does slip that grows with curvature explain the offset of the paper's odometry in DLD (table 4)?

The paper prints minimum, maximum, standard deviation and per cent within tolerance of 30 trials for x, y and yaw at
four resolutions, and no means. Each model predicts the means, equal at all resolutions. Its likelihood is that of the
minimum, the maximum and the number within tolerance of 30 normal values with the printed standard deviation; the twelve
cells count as independent. The offset by slip is that of our DLD drive, navigated without wheel errors, and linear in
the coefficient. It takes 10 s.
"""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple

import numpy as np
from bench import ALTO, CONFIG, minus, parser, plan_of, print_header, print_table
from scipy.optimize import minimize
from scipy.stats import binom, norm

from diff_encoder_sim.advice.drive_draws import ErrorFreeDrive, navigated
from diff_encoder_sim.analysis.paper.comparison import PPRS, TRIALS, load_paper_cells
from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.base.se2 import Pose2D, poses_of_wheels
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.slip import extra_travel
from diff_encoder_sim.trials.robot_params import load_robot_config, override

TEST, PPR, UNIT = 'DLD', 4096, 0.01  # [1/(m/s^2)] of the coefficients
SLIPS = {'lateral acceleration': (0.0, 1.0), 'acceleration': (1.0, 0.0)}


class Cell(NamedTuple):
    """A column of table 4, in m or degrees."""

    ppr: str
    component: int  # of x, y, yaw
    low: float
    high: float
    std: float
    within: int
    tolerance: float

    def log_likelihood(self, mean: float) -> float:
        """Return ln of the density of minimum and maximum, and of the probability of the number within between them."""
        low, high = norm.cdf((np.array([self.low, self.high]) - mean) / self.std)
        ends = norm.logpdf([self.low, self.high], mean, self.std).sum() + (TRIALS - 2) * math.log(high - low)
        inner = np.clip([-self.tolerance, self.tolerance], self.low, self.high)
        fraction = float(np.diff(norm.cdf((inner - mean) / self.std))[0]) / (high - low)
        middle = self.within - sum(abs(end) <= self.tolerance for end in (self.low, self.high))
        return float(ends + binom.logpmf(middle, TRIALS - 2, min(fraction, 1.0)))


def cells() -> List[Cell]:
    """Return the cells of odometry in DLD."""
    printed = load_paper_cells()
    printed = printed[(printed['test'] == TEST) & (printed['source'] == 'odom')]
    values = {(each.ppr, each.quantity, each.statistic): each.paper for each in printed.itertuples()}
    found = []
    for ppr in PPRS:
        for component, quantity in enumerate(QUANTITIES):
            low, high, std, percent = (values[ppr, quantity.name, key] for key in ('min', 'max', 'std', 'pct_within'))
            within = round(percent / 100.0 * TRIALS)
            found.append(Cell(ppr, component, low, high, std, within, quantity.tolerance))
    return found


def offset_per_slip(drive: ErrorFreeDrive, by_motion: tuple) -> np.ndarray:
    """Return (3,) the offset of odometry in the map [m, m, deg] per UNIT of slip."""
    rolled = drive.rolled
    extra_m = extra_travel(
        (UNIT * by_motion[0], UNIT * by_motion[1]), rolled.times_s, rolled.ways_m, rolled.separation_m
    )
    ends = [
        Pose2D(*poses_of_wheels(ways_m[np.newaxis], 1.0, 1.0, rolled.separation_m, 0.0, True)[0, -1].tolist())
        for ways_m in (rolled.ways_m, rolled.ways_m + extra_m)
    ]
    start = drive.requested.test.start.pose()
    x_m, y_m, yaw_rad = minus(*(start.compose(end) for end in reversed(ends)))
    return np.array([x_m, y_m, math.degrees(yaw_rad)])


def best(design: np.ndarray, of_table: List[Cell]) -> tuple:
    """Maximise the likelihood of means (3,) = design (3, k) @ coefficients; return these and ln of the likelihood."""

    def misfit(coefficients: np.ndarray) -> float:
        means = design @ coefficients
        return -sum(cell.log_likelihood(means[cell.component]) for cell in of_table)

    if not design.shape[1]:
        return np.zeros(0), -misfit(np.zeros(0))
    scale = 0.05 / np.maximum(abs(design).max(axis=0), 1e-9)
    found = minimize(
        lambda at: misfit(at * scale), np.zeros(len(scale)), method='Nelder-Mead', options={'maxiter': 4000}
    )
    return found.x * scale, -found.fun


def main() -> None:
    """Print the table of models."""
    arguments = parser(__doc__, trials=3).parse_args()
    print_header(__doc__.splitlines()[0])
    of_table, params = cells(), override(load_robot_config(CONFIG), {})
    for cell in of_table[:3]:
        of_quantity = [each for each in of_table if each.component == cell.component]
        means = [best(np.eye(3)[:, [cell.component]], [each])[0][0] for each in of_quantity]
        print(f'{QUANTITIES[cell.component].name}: likeliest means', ', '.join(f'{mean:.3f}' for mean in means))
    drives = [navigated(plan_of(TEST, PPR, seed), RobotSource(ALTO), params) for seed in range(1, arguments.trials + 1)]
    offsets: Dict[str, np.ndarray] = {}
    for name, by_motion in SLIPS.items():
        each = np.array([offset_per_slip(drive, by_motion) for drive in drives])
        offsets[name] = each.mean(axis=0)
        numbers = ', '.join(f'{mean:.4f} (std {std:.4f})' for mean, std in zip(offsets[name], each.std(axis=0)))
        print(f'offset by slip per {name} of {UNIT:g} 1/(m/s^2) [m, m, deg]: {numbers}')
    designs = {
        'no offset': np.zeros((3, 0)),
        'slip per lateral acceleration': np.column_stack([offsets['lateral acceleration']]),
        'slip per both accelerations': np.column_stack(list(offsets.values())),
        'constant offset': np.eye(3),
    }
    rows = []
    for name, design in designs.items():
        coefficients, log_likelihood = best(design, of_table)
        count = design.shape[1]
        aic, bic = 2.0 * count - 2.0 * log_likelihood, count * math.log(TRIALS * len(of_table)) - 2.0 * log_likelihood
        mean = design @ coefficients
        values = ' '.join(f'{each:.3f}' for each in coefficients)
        rows.append(
            (name, values, *(f'{each:.3f}' for each in mean), *(f'{each:.1f}' for each in (log_likelihood, aic, bic)))
        )
    print_table(
        rows,
        ('model', 'parameters [0.01 1/(m/s^2); m, m, deg]', 'x [m]', 'y [m]', 'yaw [deg]', 'ln L', 'AIC', 'BIC'),
        names=2,
    )


if __name__ == '__main__':
    main()
