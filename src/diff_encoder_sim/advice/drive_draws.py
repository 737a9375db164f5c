"""The odometry of one drive, drawn thousands of times: wheel phases, the encoder's errors, slip and geometry.

The robot's true way is that of the drive, as navigation or a driver keeps it there, but for where it stops. What its
wheels turn on that way follows from its true geometry and slip; what odometry makes of it, from the encoder and from
the geometry that odometry assumes.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Iterator, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice.drawn_robot import ROBOTS_CAUSES, Amounts, DrawnRobot, WheelCause
from diff_encoder_sim.advice.error_free_drives import Drive
from diff_encoder_sim.base.processes import usable_cores
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.wheels.drawn_counts import base_poses, drawn_counts, final_poses
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, EncoderModel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# A drive ends in so many places within the spread of the robot's stop.
ENDS = 512

# Odometry is told the counts so often on a drive: more reports change its end by a thousandth of its spread.
MOST_SAMPLES = 500

# So many poses at a time: beyond, arrays leave the processor's cache.
POSES_AT_A_TIME = 2**18
# Of those, wheels from so many encoders are enough, as each begins anywhere on its encoder; and so many edges are.
ENCODERS, EDGES = 128, 2**18


class DriveDraws:
    """Draws of one drive; the same draw has the same phases, geometry and slip with every encoder."""

    def __init__(self, drive: Drive, robot: DrawnRobot, seed: int) -> None:
        self.drive, self.robot, self._seed = drive, robot, seed
        samples = _samples(len(drive.rolled.times_s))
        left_m, right_m = _ways_to_ends(drive, robot.stop, generator(seed, f'{drive.test}_ends'))
        self._ways_m, self._times_s = (left_m[:, samples], right_m[:, samples]), drive.rolled.times_s[samples]
        self._ends = final_poses(*self._ways_m, drive.rolled.separation_m)

    def errors(
        self, encoders: Sequence[Optional[EncoderParams]], draws: int, amounts: Amounts = ROBOTS_CAUSES
    ) -> List[np.ndarray]:
        """Return the final errors of odometry with each encoder.

        Args:
            encoders: None for one without steps.
            draws: how many.
            amounts: of what else there is.

        Returns:
            Of each encoder (draws, 3): odometry minus true pose of the robot's base, x [m], y [m] and yaw [rad] in the
            axes of the map.
        """
        with ThreadPoolExecutor(usable_cores()) as pool:
            firsts, counts = zip(*self._portions(draws))
            found = pool.map(lambda first, count: self._portion(encoders, first, count, amounts), firsts, counts)
            return [np.concatenate(errors) for errors in zip(*found)]

    def _portions(self, draws: int) -> Iterator[Tuple[int, int]]:
        """Yield the first draw and the number of draws of each portion."""
        at_a_time = max(1, round(POSES_AT_A_TIME / len(self._times_s)))
        return ((first, min(at_a_time, draws - first)) for first in range(0, draws, at_a_time))

    def _portion(
        self, encoders: Sequence[Optional[EncoderParams]], first: int, draws: int, amounts: Amounts
    ) -> List[np.ndarray]:
        left_m, right_m = self._ways_m
        chosen = np.arange(first, first + draws) % ENDS
        turned = self._turned(left_m[chosen], right_m[chosen], first, amounts)
        contact = amounts.get(WheelCause.CONTACT, 0.0) * self._contact_error()
        truth = self._ends[chosen]
        return [self._error(encoder, turned, truth, contact, first) for encoder in encoders]

    def _turned(
        self, left_m: np.ndarray, right_m: np.ndarray, first: int, amounts: Amounts
    ) -> Tuple[np.ndarray, np.ndarray]:
        """Return (draws, n) the angles that wheels have turned since the start [rad]."""
        robot, draws = self.robot, len(left_m)
        wheels = robot.wheels(amounts, generator(self._seed, f'{self.drive.test}_wheels_{first}'), draws)
        half_m = 0.5 * (right_m - left_m) * (wheels.separation_m / self.drive.rolled.separation_m)
        mean_m = 0.5 * (left_m + right_m)
        rng = generator(self._seed, f'{self.drive.test}_slip_{first}')
        slipping = amounts.get(WheelCause.SLIP, 0.0)
        slips = (slipping * robot.errors.left_slip, slipping * robot.errors.right_slip)
        noise_m = slipping**2 * robot.errors.slip_noise
        turned = []
        for way_m, radius_m, slip in zip((mean_m - half_m, mean_m + half_m), wheels[:2], slips):
            turned_rad = way_m / radius_m / (1.0 - slip)
            if noise_m:
                steps_m2 = noise_m * np.abs(np.diff(way_m, axis=1))
                walk_m = np.cumsum(np.sqrt(steps_m2) * rng.standard_normal(steps_m2.shape), axis=1)
                turned_rad[:, 1:] += walk_m / radius_m
            turned.append(turned_rad)
        return turned[0], turned[1]

    def _error(
        self,
        encoder: Optional[EncoderParams],
        turned: Tuple[np.ndarray, np.ndarray],
        truth: np.ndarray,
        contact: np.ndarray,
        first: int,
    ) -> np.ndarray:
        odometry, robot = self.robot.odometry, self.robot
        left_m, right_m = self._told_m(encoder, turned, first)
        told = base_poses(final_poses(left_m, right_m, odometry.wheel_separation), odometry.axle_x)
        error = told - base_poses(truth, robot.axle_x_m) + contact
        return _in_map(error, self.drive.start_in_map.yaw_rad)

    def _told_m(
        self, encoder: Optional[EncoderParams], turned: Tuple[np.ndarray, np.ndarray], first: int
    ) -> Tuple[np.ndarray, np.ndarray]:
        """Return (draws, n) the ways of the wheels as odometry has them."""
        assumed_m = 0.5 * self.robot.odometry.wheel_diameter
        if encoder is None:
            return turned[0] * assumed_m, turned[1] * assumed_m
        phases = generator(self._seed, f'{self.drive.test}_phases_{first}').uniform(
            0.0, 2.0 * math.pi, (2, len(turned[0]), 1)
        )
        ppr = encoder.counts_per_turn
        told = []
        for side, counts_per_turn, turned_rad, phase_rad in zip(
            ('left', 'right'), (ppr.left, ppr.right), turned, phases
        ):
            model = encoder.encoder.of_wheel(side)
            rngs = [
                generator(self._seed, f'{self.drive.test}_{side}_{first}_{number}')
                for number in range(_encoders(model, counts_per_turn))
            ]
            counts = drawn_counts(model, counts_per_turn, phase_rad + turned_rad, self._times_s, rngs)
            told.append(counts * (2.0 * math.pi * assumed_m / counts_per_turn))
        return told[0], told[1]

    def _contact_error(self) -> np.ndarray:
        """Return (3,) how far wheels without errors are from the truth: what simulated contacts slip."""
        rolled = self.drive.rolled
        left_m, right_m = rolled.ways_m.T[:, np.newaxis]
        axle = final_poses(left_m, right_m, rolled.separation_m)
        true_end = np.array(rolled.end)[np.newaxis]
        axle_x_m = self.robot.axle_x_m
        error: np.ndarray = (base_poses(axle, axle_x_m) - base_poses(true_end, axle_x_m))[0]
        error[2] = wrap_angles(error[2])
        return error


def _ways_to_ends(drive: Drive, stop: StopSpread, rng: np.random.Generator) -> Tuple[np.ndarray, np.ndarray]:
    """Return (ENDS, n) the ways of both wheels on drives that end within the spread of the stop.

    The difference comes along the way, so that the robot still drives as it did.
    """
    left_m, right_m = drive.rolled.ways_m.T
    way_m = np.cumsum(np.abs(np.diff(drive.rolled.ways_m, axis=0, prepend=0.0)).sum(axis=1))
    fractions = way_m / max(way_m[-1], 1e-9)
    ahead_m = rng.uniform(-1.0, 1.0, (ENDS, 1)) * stop.position_m * fractions
    swing_m = rng.uniform(-1.0, 1.0, (ENDS, 1)) * 0.5 * drive.rolled.separation_m * stop.yaw_rad * fractions
    return left_m + ahead_m - swing_m, right_m + ahead_m + swing_m


def _samples(ticks: int) -> np.ndarray:
    """Return the indices of the joint states that are taken for reports."""
    return np.unique(np.linspace(0, ticks - 1, min(ticks, MOST_SAMPLES)).round().astype(np.int64))


def _encoders(model: EncoderModel, counts_per_turn: float) -> int:
    """Return how many encoders there are in a portion of the draws."""
    if model == IDEAL_ENCODER:
        return 0
    edges = counts_per_turn * model.edges_per_count if model.has_uneven_edges else 1.0
    return max(1, min(ENCODERS, int(EDGES / edges)))


def _in_map(errors: np.ndarray, start_yaw_rad: float) -> np.ndarray:
    cos, sin = math.cos(start_yaw_rad), math.sin(start_yaw_rad)
    x_m, y_m, yaw_rad = errors.T
    return np.column_stack([cos * x_m - sin * y_m, sin * x_m + cos * y_m, wrap_angles(yaw_rad)])
