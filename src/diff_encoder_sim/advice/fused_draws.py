"""Monte Carlo runs of one drive whose wheel counts are fused with a gyroscope, after a standstill.

Rates are means over a report interval; the variance of their white noise is N^2 / interval, with the quantisation of
the samples. Misalignment has no effect on a plane.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import List, Optional

import numpy as np

from diff_encoder_sim.advice import drive_draws
from diff_encoder_sim.advice.drive_draws import Amounts, DrawnRobot, DriveDraws
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.processes import usable_cores
from diff_encoder_sim.base.se2 import poses_of_wheels
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors, WheelGyroFilter
from diff_encoder_sim.trials.robot_params import wheel_uncertainty
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

STANDSTILL_S = 10.0  # before a drive
GYROSCOPE = 'gyroscope'  # cause of errors
FUSED_CAUSES: Amounts = {**drive_draws.ROBOTS_CAUSES, GYROSCOPE: 1.0}


class FusedDraws(DriveDraws):
    """Runs of a drive, with the errors of wheels and encoders of `DriveDraws`, and a gyroscope with sampled errors."""

    def __init__(self, draws: DriveDraws, imu: ImuParams, rate_hz: float) -> None:
        """Use the drive, the robot and the seed of `draws`, and reports of counts and rates at `rate_hz`."""
        rolled, rate_hz = draws.drive.rolled, min(rate_hz, imu.rate)
        times_s = np.arange(1 + max(1, round((STANDSTILL_S + rolled.times_s[-1]) * rate_hz))) / rate_hz
        columns = [np.interp(times_s - STANDSTILL_S, rolled.times_s, way_m) for way_m in rolled.ways_m.T]
        rolled = rolled._replace(times_s=times_s, ways_m=np.column_stack(columns))
        drive = draws.drive._replace(rolled=rolled, origin=drive_draws.IDEAL)  # each row is a report
        super().__init__(drive, draws.robot, draws.seed)
        # Let the heading be the integral of linearly interpolated rates at the rows, as the filter assumes.
        padded_m = np.pad(self._ways_m, ((0, 0), (1, 1), (0, 0)), 'edge')
        before_m, after_m = padded_m[:, :-2], padded_m[:, 2:]
        left_mps, right_mps = np.moveaxis(0.5 * rate_hz * (after_m - before_m), 2, 0)
        self._true_rates_radps = (right_mps - left_mps) / rolled.separation_m
        self._ways_m = 0.25 * (before_m + 2.0 * self._ways_m + after_m)
        self._ends = poses_of_wheels(self._ways_m, 1.0, 1.0, rolled.separation_m, self.robot.axle_x_m, True)[:, -1]
        self._interval_s, density = 1.0 / rate_hz, math.sqrt(imu.gyroscope.integral_variance(imu.rate))
        averaged = imu.gyroscope.model_copy(update={'noise_density': density, 'resolution': 0.0})
        self._imu = ImuParams(gyroscope=averaged, rate=rate_hz)

    @property
    def causes(self) -> List[str]:
        """Return the causes of errors, except the encoder's."""
        return [*super().causes, GYROSCOPE]

    def rates_radps(self, first: int, draws: int, amounts: Amounts) -> np.ndarray:
        """Sample the (draws, n) rates of the gyroscope at the rows."""
        sensor, rng, amount = self._imu.gyroscope, self._generator(f'gyroscope_{first}'), amounts.get(GYROSCOPE, 0.0)
        rates_radps = self._true_rates_radps[np.arange(first, first + draws) % drive_draws.ENDS]
        scales, biases = (std * rng.standard_normal((draws, 1)) for std in (sensor.scale_error, sensor.bias))
        errors = biases + sensor.noise_density / math.sqrt(self._interval_s) * rng.standard_normal(rates_radps.shape)
        kept, drift = math.exp(-self._interval_s / sensor.bias_time), sensor.bias_drift * rng.standard_normal(draws)
        for row, normals in enumerate(rng.standard_normal(rates_radps.T.shape)):
            errors[:, row] += drift
            drift = kept * drift + sensor.bias_drift * math.sqrt(1.0 - kept**2) * normals
        rates_radps += amount * (scales * rates_radps + errors)
        return np.asarray(np.clip(rates_radps, -sensor.range or -np.inf, sensor.range or np.inf))

    def _estimated(
        self, encoder: Optional[EncoderParams], turned_rad: np.ndarray, first: int, amounts: Amounts
    ) -> np.ndarray:
        assert encoder is not None, 'its counts set the gains of the filter'
        reports = self._reports(encoder, turned_rad, first)
        rates = self.rates_radps(first, len(turned_rad), amounts)
        fusion = WheelGyroFilter(FusionParams(), assumed_wheels(self.robot, reports.odometry), self._imu)
        stamps_ns, counts = self._stamps_ns, reports.counts
        with ThreadPoolExecutor(usable_cores()) as pool:
            ends = pool.map(lambda run: fusion.run(stamps_ns, run[0], stamps_ns, run[1]).pose[-1], zip(rates, counts))
            return np.stack(list(ends))


def assumed_wheels(robot: DrawnRobot, odometry: OdometryParams) -> WheelErrors:
    """Return the wheels as the filter assumes them: the geometry of odometry, with the uncertainty of the robot."""
    separation_m, (_, _, slip_m, slip_rad) = odometry.wheel_separation, robot.slip
    if robot.intervals is None:
        known = wheel_uncertainty(robot.errors)
        stds = known['distance_std'], known['turn_std'], known['diameter_difference_std']
    else:
        scale, ratio, turning = np.sqrt(robot.calibrated_covariance.diagonal()).tolist()
        stds = scale, turning, ratio
    slip_m = max(slip_m, separation_m * slip_rad)  # in place, a wheel travels half of the separation per radian
    return WheelErrors(odometry.m_per_pulse, separation_m, slip_m, *stds, odometry.axle_x, odometry.curve_noise or 0.0)
