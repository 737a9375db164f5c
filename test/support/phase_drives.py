"""Drives with sampled lengths, angles and speeds, and the NEES of odometry's covariance over wheel phases."""

import math

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import poses_of_wheels, wrap_angles
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

SEPARATION_M, DIAMETER_M, REPORT_S = 0.4, 0.2, 0.05
SPEEDS_MPS = 0.2, 0.45  # mean of the faster wheel between two corners, where the robot stops
STOP_M = 0.3  # travel of a wheel that would take as long as the stop


# Travel of the left and right wheel [m].
def straight(length_m):
    return length_m, length_m


def turn(angle_rad):
    return -0.5 * SEPARATION_M * angle_rad, 0.5 * SEPARATION_M * angle_rad


def pivot(angle_rad):
    """Return a turn about the standing left wheel, or the right one for a turn to the right."""
    return min(SEPARATION_M * angle_rad, 0.0) * -1.0, max(SEPARATION_M * angle_rad, 0.0)


def arc(angle_rad, radius_m):
    return (radius_m - 0.5 * SEPARATION_M) * angle_rad, (radius_m + 0.5 * SEPARATION_M) * angle_rad


QUARTER = 0.5 * math.pi
DRIVES = {
    'line': [straight(5.0)],
    'turns in place': [turn(4.0 * math.pi)],
    'squares, turns in place': [straight(1.0), turn(QUARTER)] * 4,
    'squares, pivots': [straight(1.0), pivot(QUARTER)] * 4,
    'out and back, pivot': [straight(2.0), pivot(math.pi), straight(2.0)],
    'zigzag': [straight(0.7), turn(1.0), straight(0.7), turn(-1.0)] * 3,
    'circle': [arc(2.0 * math.pi, 1.0)],
    'stop and go': [straight(0.5), None] * 8,
}


# The fraction of the way by the fraction of the time: it accelerates, then brakes.
PROGRESS = np.linspace(0.0, 1.0, 41)[1:]
DONE = PROGRESS**2 * (3.0 - 2.0 * PROGRESS)


def sampled_ways_m(segments, rng, steady_mps=None):
    """Return (n, 2) travel of both wheels at each report; lengths and angles differ by up to 5 %.

    The faster wheel has the speed `steady_mps` all the time; None accelerates and brakes, with another mean each time.
    """
    times_s, ways_m = [np.zeros(1)], [np.zeros((1, 2))]
    for segment in segments:
        step_m = rng.uniform(0.95, 1.05) * np.array(segment or (0.0, 0.0))
        lasts_s = (np.abs(step_m).max() or STOP_M) / (steady_mps or rng.uniform(*SPEEDS_MPS))
        times_s.append(times_s[-1][-1] + PROGRESS * lasts_s)
        ways_m.append(ways_m[-1][-1] + (PROGRESS if steady_mps else DONE)[:, np.newaxis] * step_m)
    knots_s, knots_m = np.concatenate(times_s), np.concatenate(ways_m)
    reports_s = np.arange(0.0, knots_s[-1] + REPORT_S, REPORT_S)
    return np.stack([np.interp(reports_s, knots_s, way_m) for way_m in knots_m.T], axis=1)


def sampled_nees(segments, ppr, seed, steady_mps=None):
    """Return NEES / 3 at the end of one drive from random wheel phases."""
    rng = np.random.default_rng(seed)
    ways_m = sampled_ways_m(segments, rng, steady_mps)
    stamps_ns = np.round(1e9 * REPORT_S * np.arange(len(ways_m))).astype(np.int64)
    params = OdometryParams(ppr=ppr, wheel_diameter=DIAMETER_M, wheel_separation=SEPARATION_M, motion_noise=0.0)
    return nees_of_phases(stamps_ns, ways_m / (0.5 * DIAMETER_M), params, rng.uniform(0.0, 2.0 * math.pi, 2), [-1])[0]


def nees_of_phases(stamps_ns, angles_rad, params, phases_rad, rows):
    """Return NEES / 3 after these rows of (n, 2) wheel angles, read in each row from these phases."""
    every = np.arange(len(stamps_ns))
    run = Chain(EncoderParams(ppr=params.ppr), params).run(
        Drive(stamps_ns, angles_rad), phases_rad[np.newaxis], rows=every
    )
    estimates, (left_m, right_m) = run.estimates(), params.m_per_pulse
    turns, counts = angles_rad[np.newaxis] / (2.0 * math.pi), params.counts_per_turn
    truth = poses_of_wheels(turns, left_m * counts.left, right_m * counts.right, params.wheel_separation, 0.0, False)[0]
    found = []
    for row in rows:
        error = np.array(estimates[row].base_pose_in_odom) - truth[row]
        error[2] = wrap_angles(error[2])
        found.append(error @ np.linalg.solve(estimates[row].of_pose.matrix(), error) / 3.0)
    return found
