"""Monte Carlo runs of one drive whose wheel counts are fused with a gyroscope.

The robot stands before it drives, which determines the bias. Rates are means over a report interval: their white noise
has the variance N^2 / interval, the quantisation of the samples included. Misalignment has no effect on a plane.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any, List, Optional

import numpy as np

from diff_encoder_sim.advice.drive_draws import (
    CONTACT,
    ENDS,
    IDEAL,
    ROBOTS_CAUSES,
    Amounts,
    DrawnRobot,
    DriveDraws,
    Runs,
    ends_of,
)
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.processes import usable_cores
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors, WheelGyroFilter
from diff_encoder_sim.trials.robot_params import wheel_uncertainty
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

STANDSTILL_S = 10.0  # before a drive
GYROSCOPE = 'gyroscope'  # cause of errors
FUSED_CAUSES: Amounts = {**ROBOTS_CAUSES, GYROSCOPE: 1.0}


class FusedDraws(DriveDraws):
    """Runs of a drive, with the errors of wheels and encoders of `DriveDraws`, and a gyroscope with sampled errors."""

    def __init__(self, draws: DriveDraws, imu: ImuParams, rate_hz: float) -> None:
        """Use the drive, the robot and the seed of `draws`, and reports of counts and rates at `rate_hz`."""
        rolled, rate_hz = draws.drive.rolled, min(rate_hz, imu.rate)
        reports = max(1, round((STANDSTILL_S + rolled.times_s[-1]) * rate_hz))
        times_s = np.arange(reports + 1) / rate_hz
        columns = [np.interp(times_s - STANDSTILL_S, rolled.times_s, way_m) for way_m in rolled.ways_m.T]
        rolled = rolled._replace(times_s=times_s, ways_m=np.column_stack(columns))
        super().__init__(draws.drive._replace(rolled=rolled, origin=IDEAL), draws.robot, draws.seed)  # with all rows
        # A path whose heading is the integral of linearly interpolated rates at the rows, as the filter assumes.
        before, here, after = (
            np.pad(self._ways_m, ((0, 0), (1, 1), (0, 0)), 'edge')[:, first : first + reports + 1] for first in range(3)
        )
        self._ways_m = 0.25 * before + 0.5 * here + 0.25 * after
        self._ends = ends_of(self._ways_m, rolled.separation_m, self.robot.axle_x_m)
        speeds_mps = 0.5 * rate_hz * (after - before)
        self._true_rates_radps = (speeds_mps[..., 1] - speeds_mps[..., 0]) / rolled.separation_m
        self._gyroscope, self._interval_s = imu.gyroscope, 1.0 / rate_hz
        density = math.sqrt(imu.gyroscope.noise_variance(imu.rate) / imu.rate)
        averaged = imu.gyroscope.model_copy(update={'noise_density': density, 'resolution': 0.0})
        self._averaged = ImuParams(gyroscope=averaged, rate=rate_hz)

    @property
    def causes(self) -> List[str]:
        """Return the causes of errors, except the encoder's."""
        return [*(cause for cause in super().causes if cause != CONTACT), GYROSCOPE]

    def yaw_rates_radps(self, runs: Runs) -> np.ndarray:
        """Sample the (draws, n) rates of the gyroscope at the rows."""
        sensor, rng, interval_s = self._gyroscope, self._generator(f'gyroscope_{runs.first}'), self._interval_s
        amount, draws = runs.amounts.get(GYROSCOPE, 0.0), len(runs.phases_rad)
        rates_radps = self._true_rates_radps[np.arange(runs.first, runs.first + draws) % ENDS]
        rows = rates_radps.shape[1]
        scales, biases = (
            sensor.scale_error * rng.standard_normal((draws, 1)),
            sensor.bias * rng.standard_normal((draws, 1)),
        )
        noise = self._averaged.gyroscope.noise_density / math.sqrt(interval_s) * rng.standard_normal((draws, rows))
        kept = math.exp(-interval_s / sensor.bias_time)
        drift = sensor.bias_drift * rng.standard_normal((rows, draws))
        drift[1:] *= math.sqrt(1.0 - kept**2)
        for row in range(1, rows):
            drift[row] += kept * drift[row - 1]
        rates_radps += amount * (scales * rates_radps + biases + drift.T + noise)
        return np.asarray(np.clip(rates_radps, -sensor.range or -np.inf, sensor.range or np.inf))

    def _estimated(self, encoder: Optional[EncoderParams], runs: Runs) -> np.ndarray:
        if encoder is None:
            raise ValueError('an encoder is needed, as its counts set the gains of the filter')
        reports, rates = self._reports(encoder, runs), self.yaw_rates_radps(runs)
        wheels, stamps_ns = assumed_wheels(self.robot, reports.odometry), self._stamps_ns
        fusion = WheelGyroFilter(FusionParams(), wheels, self._averaged)

        def end(draw: int) -> Any:
            return fusion.run(stamps_ns, rates[draw], stamps_ns, reports.counts[draw]).pose[-1]

        with ThreadPoolExecutor(usable_cores()) as pool:
            return np.stack(list(pool.map(end, range(len(rates)))))


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
    return WheelErrors(odometry.m_per_pulse, separation_m, slip_m, *stds, odometry.axle_x)
