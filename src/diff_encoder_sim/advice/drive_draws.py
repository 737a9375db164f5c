"""Monte Carlo runs of the odometry of one drive over wheel phases, encoder errors, slip and geometry.

The true path is that of the drive, as navigation or a driver keeps the robot on it; only the final pose varies. The
wheel angles follow from the path, the true geometry and slip; odometry follows from the angles, the encoder and the
geometry that odometry assumes.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Iterator, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice.drawn_robot import ROBOTS_CAUSES, Amounts, DrawnRobot, WheelCause
from diff_encoder_sim.advice.error_free_drives import ErrorFreeDrive
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.processes import usable_cores
from diff_encoder_sim.base.se2 import Pose2D, poses_of_wheels, wrap_angles
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.report_link import PROMPT
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# Number of final poses within the spread of the robot's stop.
ENDS = 512

# Maximum number of count reports per drive: more change the final error by a thousandth of its spread.
MOST_SAMPLES = 500

# Poses per portion; larger arrays do not fit the processor's cache.
POSES_AT_A_TIME = 2**18


class DriveDraws:
    """Monte Carlo runs of one drive; run i has the same phases, geometry and slip with every encoder."""

    def __init__(self, drive: ErrorFreeDrive, robot: DrawnRobot, seed: int) -> None:
        self.drive, self.robot, self._seed = drive, robot, seed
        samples = _samples(len(drive.rolled.times_s))
        left_m, right_m = _ways_to_ends(drive, robot.stop, generator(seed, f'{drive.test}_ends'))
        self._ways_m = left_m[:, samples], right_m[:, samples]
        self._ends = _ends(np.stack(self._ways_m, axis=-1), drive.rolled.separation_m, robot.axle_x_m)
        self._stamps_ns = np.rint(1e9 * drive.rolled.times_s[samples]).astype(np.int64)
        self._commands = np.diff(drive.rolled.ways_m[samples], axis=0, prepend=0.0)

    def errors(
        self, encoders: Sequence[Optional[EncoderParams]], draws: int, amounts: Amounts = ROBOTS_CAUSES
    ) -> List[np.ndarray]:
        """Return the final errors of odometry with each encoder.

        Args:
            encoders: encoders to compare; None is one without quantisation.
            draws: number of runs.
            amounts: amounts of the other causes.

        Returns:
            (draws, 3) per encoder: odometry minus true pose of the base, x [m], y [m] and yaw [rad] in the axes of the
            map.
        """
        with ThreadPoolExecutor(usable_cores()) as pool:
            firsts, counts = zip(*self._portions(draws))
            found = pool.map(lambda first, count: self._portion(encoders, first, count, amounts), firsts, counts)
            return [np.concatenate(errors) for errors in zip(*found)]

    def _portions(self, draws: int) -> Iterator[Tuple[int, int]]:
        """Yield the first draw and the number of draws of each portion."""
        at_a_time = max(1, round(POSES_AT_A_TIME / len(self._stamps_ns)))
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

    def _turned(self, left_m: np.ndarray, right_m: np.ndarray, first: int, amounts: Amounts) -> np.ndarray:
        """Return the (draws, n, 2) wheel angles since the start [rad]."""
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
        return np.stack(turned, axis=-1)

    def _error(
        self,
        encoder: Optional[EncoderParams],
        turned_rad: np.ndarray,
        truth: np.ndarray,
        contact: np.ndarray,
        first: int,
    ) -> np.ndarray:
        odometry = self.robot.odometry
        if encoder is None:
            radius_m = 0.5 * odometry.wheel_diameter
            estimated = _ends(turned_rad, odometry.wheel_separation, odometry.axle_x, radius_m)
        else:
            drive, draws, rows = Drive(self._stamps_ns, turned_rad), len(turned_rad), np.arange(len(self._stamps_ns))
            phases = generator(self._seed, f'{self.drive.test}_phases_{first}')
            phases_rad = phases.uniform(0.0, 2.0 * math.pi, (draws, 2))
            estimated = self._chain(encoder, first, draws).run(drive, phases_rad, self._commands, rows).final_poses
        return _in_map(estimated - truth + contact, self.drive.start_in_map.yaw_rad)

    def _chain(self, encoder: EncoderParams, first: int, draws: int) -> Chain:
        """Return an encoder and its odometry, without delays of reports."""
        seed = int(generator(self._seed, f'{self.drive.test}_encoders_{first}').integers(2**31))
        read_at_once = {'report': PROMPT, 'counter_modulus': 0, 'velocity_method': 'M', 'seed': seed}
        known = {'ppr': encoder.ppr, 'encoder': encoder.encoder, 'counter_modulus': 0}
        return Chain(encoder.model_copy(update=read_at_once), self.robot.odometry.model_copy(update=known), draws)

    def _contact_error(self) -> np.ndarray:
        """Return the (3,) error of error-free wheels, caused by slip at the simulated contacts."""
        rolled, axle_x_m = self.drive.rolled, self.robot.axle_x_m
        wheels = _ends(rolled.ways_m[np.newaxis], rolled.separation_m, axle_x_m)[0]
        axle = Pose2D(axle_x_m, 0.0, 0.0)
        truth = axle.compose(rolled.end).compose(axle.inverse())
        error: np.ndarray = wheels - np.array(truth)
        error[2] = wrap_angles(error[2])
        return error


def _ways_to_ends(drive: ErrorFreeDrive, stop: StopSpread, rng: np.random.Generator) -> Tuple[np.ndarray, np.ndarray]:
    """Return the (ENDS, n) distances of both wheels on drives that end within the spread of the stop.

    The deviation grows in proportion to the distance.
    """
    left_m, right_m = drive.rolled.ways_m.T
    way_m = np.cumsum(np.abs(np.diff(drive.rolled.ways_m, axis=0, prepend=0.0)).sum(axis=1))
    fractions = way_m / max(way_m[-1], 1e-9)
    ahead_m = rng.uniform(-1.0, 1.0, (ENDS, 1)) * stop.position_m * fractions
    swing_m = rng.uniform(-1.0, 1.0, (ENDS, 1)) * 0.5 * drive.rolled.separation_m * stop.yaw_rad * fractions
    return left_m + ahead_m - swing_m, right_m + ahead_m + swing_m


def _samples(ticks: int) -> np.ndarray:
    """Return the indices of the joint states used for reports."""
    return np.unique(np.linspace(0, ticks - 1, min(ticks, MOST_SAMPLES)).round().astype(np.int64))


def _ends(turned: np.ndarray, wheel_separation_m: float, axle_x_m: float, per_turned_m: float = 1.0) -> np.ndarray:
    """Return the (draws, 3) final pose of the base relative to its start, from exact wheel angles."""
    return poses_of_wheels(turned, per_turned_m, per_turned_m, wheel_separation_m, axle_x_m, True)[:, -1]


def _in_map(errors: np.ndarray, start_yaw_rad: float) -> np.ndarray:
    cos, sin = math.cos(start_yaw_rad), math.sin(start_yaw_rad)
    x_m, y_m, yaw_rad = errors.T
    return np.column_stack([cos * x_m - sin * y_m, sin * x_m + cos * y_m, wrap_angles(yaw_rad)])
