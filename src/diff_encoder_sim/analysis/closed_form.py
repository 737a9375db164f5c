"""Odometry error at the goal: closed form of quantisation, and measured values."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import ppr_value
from diff_encoder_sim.analysis.quantities import MINUS_TRUTH, QUANTITIES, YAW
from diff_encoder_sim.analysis.result_tables import Column, ResultTable
from diff_encoder_sim.analysis.results_table import Results, RobotGeometry, final_errors
from diff_encoder_sim.analysis.statistics import spread, std_interval
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.wheels.covariance import quantisation_covariance, reading_variance

STRAIGHT_WITHIN = 1e-9  # tolerance [m, rad] for a goal straight ahead
LEAST_PULSES = 0.1  # standard deviation of a position [pulses], below which the errors under way exceed it
DECIMALS = 9  # of a number of pulses; the rest is rounding


def closed_form_std(requested: Trial, robot: RobotGeometry, ppr: float) -> np.ndarray:
    """Return the (3,) standard deviations at the goal due to quantisation, along the map's axes: [m], [m], [rad].

    They are averaged over the final wheel positions within a pulse, for drives whose ends differ by more than a pulse.
    The lateral value of a straight drive does not depend on its end; for the heading see `heading_std_rad`. A position
    that whole turns do not change has 0: its error is that of rounding under way.
    """
    start, m_per_pulse = requested.test.start.pose(), math.pi * robot.wheel_diameter_m / ppr
    variance_m2, goal = reading_variance(m_per_pulse), requested.goal().relative_to(start)
    covariance = quantisation_covariance(goal, (variance_m2, variance_m2), robot.wheel_separation_m)
    turn, cos_yaw, sin_yaw = np.eye(3), math.cos(start.yaw_rad), math.sin(start.yaw_rad)
    turn[:2, :2] = [[cos_yaw, -sin_yaw], [sin_yaw, cos_yaw]]
    stds = np.sqrt(np.diag(turn @ covariance.matrix() @ turn.T))
    return np.where(stds < (LEAST_PULSES * m_per_pulse, LEAST_PULSES * m_per_pulse, 0.0), 0.0, stds)


def heading_std_rad(wheel_travel_m: np.ndarray, m_per_pulse: float, wheel_separation_m: float) -> float:
    """Compute the standard deviation of the heading if both wheels travel the same distance.

    A wheel that travels k + f pulses, 0 <= f < 1, from a uniform phase counts k + 1 with probability f, otherwise k:
    the variance is f (1 - f), and that of the heading 2 f (1 - f) (d/L)^2. The average over f is (d/L)^2 / 3; after
    whole pulses the variance is zero. Averaged over the (n,) travels of each wheel in n equally likely drives, forward
    or backward; d is `m_per_pulse`, L the separation.
    """
    fractions = np.mod(np.round(wheel_travel_m / m_per_pulse, DECIMALS), 1.0)
    return m_per_pulse / wheel_separation_m * math.sqrt(2.0 * float(np.mean(fractions * (1.0 - fractions))))


def gyro_heading_std_rad(imu: ImuParams, standstill_s: float, time_s: np.ndarray) -> np.ndarray:
    """Compute the standard deviations (n,) of the heading by a gyroscope, (n,) seconds t after a standstill T.

    The bias is the mean rate at rest. White noise of density N makes the variance N^2 t (1 + t / T), the Gauss-Markov
    drift of the bias, of standard deviation s and time constant c, f(t) + (t / T)^2 f(T) less twice their covariance,
    with f(t) = 2 s^2 c^2 (t / c - 1 + exp(-t / c)). A turn adds its angle times the scale error.
    """
    constant_s, ratio = imu.gyroscope.bias_time, time_s / standstill_s
    grown, grown_at_rest = np.expm1(-time_s / constant_s), math.expm1(-standstill_s / constant_s)
    drift = time_s / constant_s + grown + ratio**2 * (standstill_s / constant_s + grown_at_rest)
    drift = 2.0 * (imu.gyroscope.bias_drift * constant_s) ** 2 * (drift - ratio * grown * grown_at_rest)
    white = imu.gyroscope.integral_variance(imu.rate)
    return np.asarray(np.sqrt(white * time_s * (1.0 + ratio) + drift))


def wheels_heading_std_rad(
    robot: RobotGeometry, ppr: float, distance_m: np.ndarray, travel_variance: float, difference_std: float
) -> np.ndarray:
    """Compute the standard deviations (n,) of the heading by the wheels after (n,) metres S straight.

    Quantisation, slip k [m^2/m] of each wheel and a relative difference e of the diameters make the variance
    (d / L)^2 / 3 + 2 k S / L^2 + (e S / L)^2.
    """
    of_path_m2 = 2.0 * travel_variance * distance_m + (difference_std * distance_m) ** 2
    return np.asarray(
        np.sqrt((math.pi * robot.wheel_diameter_m / ppr) ** 2 / 3.0 + of_path_m2) / robot.wheel_separation_m
    )


def crossover_counts(robot: RobotGeometry, gyro_std_rad: np.ndarray, wheels_std_rad: np.ndarray) -> np.ndarray:
    """Compute the counts per revolution (n,) with which encoder and gyroscope are equally uncertain of the heading.

    `wheels_std_rad` is without quantisation. Infinite if the gyroscope is better than any encoder.
    """
    rest_rad = np.sqrt(3.0 * np.maximum(np.square(gyro_std_rad) - np.square(wheels_std_rad), 1e-30))
    counts = math.pi * robot.wheel_diameter_m / robot.wheel_separation_m / rest_rad
    return np.where(np.greater(gyro_std_rad, wheels_std_rad), counts, np.inf)


def wheel_travel_m(requested: Trial, robot: RobotGeometry, true_minus_goal: np.ndarray) -> Optional[np.ndarray]:
    """Return the (n,) travel of each wheel; None unless the drive is one straight line or turns in place.

    `true_minus_goal` are the (n, 3) final true poses minus the goal, along the map's axes [m, m, rad].
    """
    test, start = requested.test, requested.test.start.pose()
    if requested.nav == 'scripted':
        motions = [segment.motion for segment in test.drive]
    else:
        to_goal = requested.goal().relative_to(start)
        *legs, _ = test.route
        if any(leg.turns is None for leg in legs) or max(abs(to_goal.y_m), abs(to_goal.yaw_rad)) > STRAIGHT_WITHIN:
            return None
        motions = [(0.0, 2.0 * math.pi * (leg.turns or 0.0)) for leg in legs] + [(to_goal.x_m, 0.0)]
    motions = [motion for motion in motions if max(map(abs, motion)) > STRAIGHT_WITHIN]
    if len(motions) != 1 or all(motions[0]):
        return None
    [(straight_m, turn_rad)], (x_m, y_m, yaw_rad) = motions, true_minus_goal.T
    ahead_m = straight_m + math.cos(start.yaw_rad) * x_m + math.sin(start.yaw_rad) * y_m
    travel_m: np.ndarray = 0.5 * robot.wheel_separation_m * (turn_rad + yaw_rad) if turn_rad else ahead_m
    return travel_m


SCALED = {'m': ('mm', 1e3), 'deg': ('deg', 1.0)}  # standard deviations range over three decades of millimetres
DIGITS = 3


def closed_form_table(results: Results) -> Optional[ResultTable]:
    """Build a table with a row per cell and quantity; None if no cell has both values."""
    robot, rows = results.robot, []
    for cell, of_cell in results.trials.groupby('cell', sort=False):
        ppr, requested = ppr_value(of_cell['ppr'].iloc[0]), results.requested.get(of_cell['test'].iloc[0])
        known = of_cell.dropna(subset=[f'{MINUS_TRUTH}_x_m'])
        if ppr is None or requested is None or len(known) < 2:
            continue
        expected_stds = closed_form_std(requested, robot, ppr)
        stops = known[['world_x_m', 'world_y_m', 'world_yaw_rad']].to_numpy(dtype=float)
        travels_m, pulse_m = wheel_travel_m(requested, robot, stops), math.pi * robot.wheel_diameter_m / ppr
        if travels_m is not None:
            expected_stds[YAW.component] = heading_std_rad(travels_m, pulse_m, robot.wheel_separation_m)
        for quantity, expected_std in zip(QUANTITIES, expected_stds.tolist()):
            unit, scale = SCALED[quantity.unit]
            errors, expected = scale * final_errors(known, MINUS_TRUTH, quantity), scale * quantity.scale * expected_std
            if not expected:
                continue
            low, high = std_interval(errors)
            row = {'cell': cell, 'quantity': f'{quantity.axis} [{unit}]', 'expected': f'{expected:.{DIGITS}g}'}
            row['measured'] = f'{spread(errors) or 0.0:.{DIGITS}g} ({low:.{DIGITS}g} to {high:.{DIGITS}g})'
            row['conclusion'] = 'above' if low > expected else 'below' if high < expected else 'as expected'
            rows.append(row)
    title = 'Final /odom minus /world_pose: closed form and measured'
    heads = {'expected': 'quantisation, at the final poses', 'measured': 'measured (95 % interval)'}
    heads['conclusion'] = 'measured is'
    columns = {name: Column(head, 'standard deviation') for name, head in heads.items()}
    return ResultTable('closed_form', title, pd.DataFrame(rows), columns) if rows else None
