"""Fusion of wheel counts and a gyroscope by an extended Kalman filter: pose, twist and bias of the gyroscope.

Counting is a bounded error, not white noise. The filter therefore estimates the travel of each wheel and its remainder,
the part of it that is not counted yet: `counts x metres per count = travel - remainder` has hardly any noise. The
remainder is uniform in a count, and a sawtooth of the travel (docs/adr/0002-odometry-covariance.md).

Elastic slip in proportion to the acceleration makes a wheel turn ahead of the robot: it acts as a delay of the
gyroscope, like an error of the clocks. The filter considers the uncertainty of the delay, and does not estimate it.

At rest, neither the speeds nor the heading since the wheels stopped change (zero velocity and zero integrated heading
rate, Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd edition, section 15.3).
The heading at the stop is a state, so that all samples since then contribute to the bias.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Optional, Tuple

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.params import Params, not_allowed, param
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

FrameId = Annotated[str, Field(min_length=1)]

# States: x, y [m] and yaw [rad] of base_link, speeds [m/s, rad/s], bias of the gyroscope [rad/s], which are ESTIMATED;
# measured travels of both wheels [m]; relative errors of turns, of the right minus the left diameter, and of distances;
# relative scale error of the gyroscope; remainders of both wheels [m]; yaw at the last stop [rad]; delay of
# rates against counts [s].
X, Y, YAW, V, OMEGA, BIAS, ESTIMATED = range(7)
TRAVEL, TURN, DIFFERENCE, DISTANCE, SCALE, REMAINDER, STOP_YAW, DELAY, STATES = 6, 8, 9, 10, 11, 12, 14, 15, 16
CONSIDERED = (DISTANCE, DELAY)  # not estimated (Schmidt-Kalman filter): no sensor measures distances, the delay varies
MOVED = (X, Y, YAW, TRAVEL, TRAVEL + 1)  # by the speeds; before their sources, YAW of X and Y

START_SPEED_STD = 1.0  # [m/s] and [rad/s]: the robot may be in motion at the first report
READING_VARIANCE = 1e-4  # of counts [counts^2]: small, but the filter must stay regular
REST_OMEGA_STD, REST_YAW_STD = 1e-4, 1e-6  # [rad/s], [rad]
SETTLING_STD = 3e-4  # rotation of the body after the wheels have stopped, as on tyres [rad]
TURNING_STD = 5.0  # a rate this far from the mean since the stop, in standard deviations, means rotation
RATES_OF_MEAN = 10  # a mean of fewer rates is not used
HARMONICS = 4  # of the sawtooth
SLIP_RAD = 1.0  # standard deviation of the heading by the wheels, if they slip, in a report


class FusionParams(Params):
    """Parameters of odometry_fusion_node; names of robot_localization if they mean the same."""

    frequency: bounds.Rate_Hz = param(30.0, 'largest rate of published estimates [Hz]')
    odom_frame: FrameId = param('odom', 'frame of the odometry')
    base_link_frame: FrameId = param('base_link', 'frame of the robot')
    world_frame: Optional[FrameId] = param(None, 'frame of the estimate: odom_frame, as the sensors drift')
    publish_tf: bool = param(True, 'broadcast world_frame -> base_link_frame on TF')
    linear_process_noise: Annotated[float, bounds.Between(1e-9, 1e6, 'm^2/s^3')] = param(
        0.2, 'variance of the change of the linear speed in a second [m^2/s^3]'
    )
    angular_process_noise: Annotated[float, bounds.Between(1e-9, 1e6, 'rad^2/s^3')] = param(
        3.0, 'variance of the change of the angular speed in a second [rad^2/s^3]'
    )
    delay_std: bounds.Duration_s = param(
        0.002, 'standard deviation of the time of rates minus that of counts; elastic slip in turns acts as a delay [s]'
    )
    standing_reports: bounds.Count = param(10, 'reports without a count, and without rotation, until the robot rests')
    wheel_timeout: bounds.PositiveDuration_s = param(0.5, 'without counts for longer, no motion is reported [s]')
    gyro_timeout: bounds.PositiveDuration_s = param(
        0.5, 'without rates for longer, only the wheels are used; also the largest age of a rate [s]'
    )

    slip_window: bounds.PositiveDuration_s = param(0.5, 'duration of the comparison of wheels and gyroscope [s]')
    slip_threshold: bounds.PositiveWeight = param(5.5, 'difference of the headings that is slip [standard deviations]')

    @model_validator(mode='after')
    def _check_world_frame(self) -> FusionParams:
        if self.world_frame not in (None, self.odom_frame):
            raise not_allowed('world_frame', self.world_frame, f'odom_frame ({self.odom_frame})')
        return self


class WheelErrors(NamedTuple):
    """Assumed geometry of the wheels, and its errors; those of distances and turns are relative."""

    m_per_count: Tuple[float, float]  # of the left and the right rim
    separation_m: float
    travel_variance: float = 0.0  # of a wheel's travel per metre of it [m^2/m]
    distance_std: float = 0.0
    turn_std: float = 0.0
    diameter_difference_std: float = 0.0  # right minus left, relative to their mean
    axle_x_m: float = 0.0  # place of the axle ahead of base_link
    curve_noise: float = 0.0  # of a wheel's travel per metre of it and lateral acceleration squared [m^2/m/(m/s^2)^2]


FILTER = np.dtype(
    [
        ('mean', 'f8', STATES),
        ('cov', 'f8', (STATES, STATES)),
        ('stamp_ns', 'i8'),
        ('counts_ns', 'i8'),  # of the last report; -1 before the first
        ('rate_ns', 'i8'),  # of the last rate; -1 before the first
        ('counts', 'i8', 2),
        ('first_counts', 'i8', 2),
        ('travel_m', 'f8', 2),  # at the last report
        ('omega_radps', 'f8'),  # at the last report
        ('quiet', 'i8', 2),  # reports since the last count of a wheel
        ('standing', 'i8'),  # reports since the stop
        ('rates', 'i8'),  # number since the stop
        ('mean_rate_radps', 'f8'),  # since the stop
        ('is_turning', 'i8'),  # by the gyroscope, since the last report
    ],
    align=True,
)


class FusedEstimate(NamedTuple):
    """Estimate of the filter; from `run` (m,) estimates, so that each shape begins with m."""

    stamp_ns: np.ndarray  # () int64
    pose: np.ndarray  # (3,) x [m], y [m], yaw [rad] in [-pi, pi) of base_link in the odom frame
    twist: np.ndarray  # (2,) linear [m/s], angular [rad/s]
    pose_covariance: np.ndarray  # (3, 3)
    twist_covariance: np.ndarray  # (2, 2)
    gyro_bias_radps: np.ndarray  # ()
    gyro_bias_variance: np.ndarray  # () [rad^2/s^2]


class WheelGyroFilter:
    """Extended Kalman filter of wheel counts and rates of a gyroscope; the first report of counts is at pose zero.

    Without rates it continues with the wheels. Without counts it continues with the gyroscope at the last speed for
    `wheel_timeout`, and then reports no motion until the next counts, which move it by the missed travel.
    """

    def __init__(self, params: FusionParams, wheels: WheelErrors, imu: ImuParams) -> None:
        """Use the parameters of the gyroscope of `imu`; without an IMU, give its default, and no rates."""
        self.params, self._wheels, self._gyroscope = params, wheels, imu.gyroscope
        model = {
            **wheels._asdict(),
            'speed_noise': (params.linear_process_noise, params.angular_process_noise),
            'rate_variance': imu.gyroscope.noise_variance(imu.rate),
            'bias_noise': 2.0 * imu.gyroscope.bias_drift**2 / imu.gyroscope.bias_time,
            'standing_reports': params.standing_reports,
            'wheel_timeout_ns': round(params.wheel_timeout * NANOSECONDS_PER_SECOND),
            'gyro_timeout_ns': round(params.gyro_timeout * NANOSECONDS_PER_SECOND),
        }
        fields = [(name, np.asarray(value).dtype, np.shape(value)) for name, value in model.items()]
        self._model = np.array([tuple(model.values())], np.dtype(fields, align=True))[0]
        self.reset()

    def reset(self) -> None:
        """Return to pose zero; the next report of counts is the start."""
        self._filter = self._new_filter()

    def take_gyro(self, stamp_ns: int, yaw_rate_radps: float) -> None:
        """Process a finite rate about the vertical axis; before the first counts it is ignored.

        A rate older than the newest counts corrects the current speed.
        """
        _process_rate(self._filter, self._model, stamp_ns, yaw_rate_radps)

    def take_slip(self) -> None:
        """Expect slip until the next counts, which then correct the distance, not the heading."""
        travels, slip_m = slice(TRAVEL, TRAVEL + 2), 0.5 * self._wheels.separation_m * np.array([-SLIP_RAD, SLIP_RAD])
        self._filter['cov'][travels, travels] += np.outer(slip_m, slip_m)

    def take_counts(self, stamp_ns: int, left_total: int, right_total: int) -> None:
        """Process accumulated counts, without wraps, with a stamp later than the one before."""
        _process_counts(self._filter, self._model, stamp_ns, left_total, right_total)

    def take_time(self, stamp_ns: int) -> None:
        """Move to a stamp without measurements; after `wheel_timeout` without counts the robot does not move."""
        _advance(self._filter, self._model, stamp_ns)

    @property
    def estimate(self) -> FusedEstimate:
        """Return the estimate at the newest stamp, or at the last one with known motion."""
        estimated = self._filter['mean'][:ESTIMATED].copy(), self._filter['cov'][:ESTIMATED, :ESTIMATED].copy()
        return _estimate_of(self._filter['stamp_ns'], *estimated)

    @property
    def is_at_rest(self) -> bool:
        """Return whether the robot has stood for `standing_reports`."""
        return bool(self._filter['standing'] >= self.params.standing_reports)

    def run(
        self, stamps_ns: np.ndarray, yaw_rates_radps: np.ndarray, report_stamps_ns: np.ndarray, counts: np.ndarray
    ) -> FusedEstimate:
        """Return the estimates after each report, as the steps of a new filter do, bit for bit.

        Args:
            stamps_ns: (n,) increasing stamps of the rates; of equal stamps, the rate is before the counts.
            yaw_rates_radps: (n,) finite.
            report_stamps_ns: (m,) increasing.
            counts: (m, 2) int64, accumulated, left and right.
        """
        reports = len(report_stamps_ns)
        means, covs = np.zeros((reports, ESTIMATED)), np.zeros((reports, ESTIMATED, ESTIMATED))
        filter_ = self._new_filter()
        _run(filter_, self._model, stamps_ns, yaw_rates_radps, report_stamps_ns, counts, means, covs)
        return _estimate_of(report_stamps_ns, means, covs)

    def _new_filter(self) -> Any:
        """Return a FILTER before the first counts: each remainder is uniform."""
        wheels, gyroscope, filters = self._wheels, self._gyroscope, np.zeros(1, FILTER)
        filters['counts_ns'] = filters['rate_ns'] = -1
        mean, cov = filters['mean'][0], filters['cov'][0]
        for wheel, m_per_count in enumerate(wheels.m_per_count):
            both = [TRAVEL + wheel, REMAINDER + wheel]
            mean[both] = filters['travel_m'][0, wheel] = 0.5 * m_per_count
            cov[np.ix_(both, both)] = m_per_count**2 / 12.0
        uncertain = [V, OMEGA, TURN, DIFFERENCE, DISTANCE, BIAS, SCALE, DELAY]
        geometry_stds = wheels.turn_std, wheels.diameter_difference_std, wheels.distance_std
        of_rates = gyroscope.bias_std, gyroscope.scale_error, self.params.delay_std
        stds = [START_SPEED_STD, START_SPEED_STD, *geometry_stds, *of_rates]
        cov[uncertain, uncertain] = np.square(stds)
        return filters[0]


def warm_up() -> None:
    """Compile the kernels."""
    made, stamps_ns = WheelGyroFilter(FusionParams(), WheelErrors((1.0, 1.0), 1.0), ImuParams()), np.arange(2)
    made.run(stamps_ns, np.zeros(2), stamps_ns, np.zeros((2, 2), np.int64))
    made.take_counts(0, 0, 0)
    made.take_gyro(1, 0.0)


def _estimate_of(stamp_ns: np.ndarray, mean: np.ndarray, cov: np.ndarray) -> FusedEstimate:
    """Return the estimate of (..., ESTIMATED) states and their covariance."""
    pose, speeds = mean[..., :V], slice(V, BIAS)
    pose[..., YAW] = wrap_angles(pose[..., YAW])
    of_pose, of_twist = cov[..., :V, :V], cov[..., speeds, speeds]
    return FusedEstimate(stamp_ns, pose, mean[..., speeds], of_pose, of_twist, mean[..., BIAS], cov[..., BIAS, BIAS])


@compiled
def _move(filter_: Any, model: Any, interval_s: float) -> None:
    """Move by the speeds, which are a random walk."""
    mean, cov, slopes = filter_.mean, filter_.cov, np.zeros((STATES, STATES))  # derivatives of MOVED by other states
    v, omega, half_m = mean[V], mean[OMEGA], 0.5 * model.separation_m
    mid_yaw_rad = mean[YAW] + 0.5 * omega * interval_s
    cos_s, sin_s = interval_s * math.cos(mid_yaw_rad), interval_s * math.sin(mid_yaw_rad)
    x_m, y_m = v * cos_s + model.axle_x_m * omega * sin_s, v * sin_s - model.axle_x_m * omega * cos_s
    slopes[X, V], slopes[Y, V], slopes[YAW, OMEGA] = cos_s, sin_s, interval_s
    slopes[X, YAW], slopes[X, OMEGA] = -y_m, model.axle_x_m * sin_s - 0.5 * interval_s * y_m
    slopes[Y, YAW], slopes[Y, OMEGA] = x_m, -model.axle_x_m * cos_s + 0.5 * interval_s * x_m
    mean[X] += x_m
    mean[Y] += y_m
    mean[YAW] += omega * interval_s
    for wheel in range(2):
        side, row = 2.0 * wheel - 1.0, TRAVEL + wheel
        lever_m = side * half_m * (1.0 + mean[TURN])
        rim_m = (v + lever_m * omega) * interval_s
        diameter, distance = 1.0 + 0.5 * side * mean[DIFFERENCE], 1.0 + mean[DISTANCE]
        slopes[row, V] = distance * diameter * interval_s
        slopes[row, OMEGA], slopes[row, TURN] = slopes[row, V] * lever_m, slopes[row, V] * side * half_m * omega
        slopes[row, DIFFERENCE], slopes[row, DISTANCE] = 0.5 * side * distance * rim_m, diameter * rim_m
        mean[row] += distance * diameter * rim_m
    for moved in MOVED:
        for other in range(STATES):
            for source in range(YAW, SCALE):
                cov[moved, other] += slopes[moved, source] * cov[source, other]
    for moved in MOVED:
        for other in range(STATES):
            for source in range(YAW, SCALE):
                cov[other, moved] += slopes[moved, source] * cov[other, source]
    noise_s = min(interval_s, 1e-9 * model.wheel_timeout_ns)  # after a longer time, counts give the speed
    for speed in range(2):
        effect = 0.5 * slopes[:, V + speed]  # the acceleration is constant: half of the change acts on the path
        effect[V + speed] = 1.0
        for row in range(TURN):
            for column in range(TURN):
                cov[row, column] += model.speed_noise[speed] * noise_s * effect[row] * effect[column]
    for wheel in range(2):
        rim_m = (v + (2.0 * wheel - 1.0) * half_m * omega) * interval_s
        variance_m = model.travel_variance + model.curve_noise * (v * omega) ** 2
        cov[TRAVEL + wheel, TRAVEL + wheel] += variance_m * abs(rim_m)
    cov[BIAS, BIAS] += model.bias_noise * interval_s


@compiled
def _correct(filter_: Any, slopes: Array, error: float, variance: float) -> None:
    """Correct by one measurement: its derivatives by the states (STATES,), its error, and the variance of its noise."""
    cov, gains = filter_.cov, np.zeros(STATES)
    for state in range(STATES):
        for other in range(STATES):
            gains[state] += cov[state, other] * slopes[other]
        variance += slopes[state] * gains[state]
    if variance <= 0.0:  # known exactly, of an ideal sensor
        return
    for state in range(STATES):
        is_considered = state in CONSIDERED
        if not is_considered:
            filter_.mean[state] += gains[state] * error / variance
        for other in range(STATES):
            if not (is_considered and other in CONSIDERED):
                cov[state, other] -= gains[state] * gains[other] / variance


@compiled
def _set_zero(filter_: Any, state: int, variance: float) -> None:
    slopes = np.zeros(STATES)
    slopes[state] = 1.0
    _correct(filter_, slopes, -filter_.mean[state], variance)


@compiled
def _advance(filter_: Any, model: Any, stamp_ns: int) -> Any:
    """Move to a stamp, or to the timeout of the counts, at which speeds become 0; return whether it is reached."""
    end_ns = min(stamp_ns, filter_.counts_ns + model.wheel_timeout_ns)
    if end_ns > filter_.stamp_ns:
        _move(filter_, model, 1e-9 * (end_ns - filter_.stamp_ns))
        filter_.stamp_ns = end_ns
    if end_ns < stamp_ns:
        filter_.mean[V] = filter_.mean[OMEGA] = 0.0
    return end_ns == stamp_ns


@compiled
def _process_rate(filter_: Any, model: Any, stamp_ns: int, rate_radps: float) -> None:
    if filter_.counts_ns < 0:
        return
    filter_.rate_ns = stamp_ns
    if not _advance(filter_, model, stamp_ns):
        return
    mean, slopes, variance = filter_.mean, np.zeros(STATES), model.rate_variance
    error = rate_radps - (1.0 + mean[SCALE]) * mean[OMEGA] - mean[BIAS]
    is_ramp = error**2 > TURNING_STD**2 * variance  # a hard acceleration: the speed is not the predicted one
    slopes[OMEGA], slopes[BIAS], slopes[SCALE] = 1.0 + mean[SCALE], 1.0, mean[OMEGA] + error * is_ramp
    _correct(filter_, slopes, error, variance)
    rates, off_radps = filter_.rates, rate_radps - filter_.mean_rate_radps
    if rates > RATES_OF_MEAN and off_radps**2 > TURNING_STD**2 * variance * (1.0 + 1.0 / rates):
        filter_.is_turning = 1
    filter_.rates = rates + 1
    filter_.mean_rate_radps += off_radps / (rates + 1)


@compiled
def _correlation(moved: float, moved_std: float) -> float:
    """Return the correlation of a sawtooth with itself `moved` counts further, for a normal movement."""
    total, weights = 0.0, 0.0
    for harmonic in range(1, HARMONICS + 1):
        weight, angle = 1.0 / harmonic**2, 2.0 * math.pi * harmonic
        weights += weight
        total += weight * math.cos(angle * moved) * math.exp(-0.5 * (angle * moved_std) ** 2)
    return total / weights


@compiled
def _renew_remainder(filter_: Any, model: Any, wheel: int, interval_s: float) -> None:
    """Let a remainder lose its value as far as the travel since the last report turns the sawtooth."""
    mean, cov, m_per_count, state = filter_.mean, filter_.cov, model.m_per_count[wheel], REMAINDER + wheel
    lever_m, quiet = (wheel - 0.5) * model.separation_m, filter_.quiet[wheel]
    speed_variance = cov[V, V] + 2.0 * lever_m * cov[V, OMEGA] + lever_m**2 * cov[OMEGA, OMEGA]
    moved = abs(mean[TRAVEL + wheel] - filter_.travel_m[wheel]) / m_per_count
    moved_std = math.sqrt(max(speed_variance, 0.0)) * interval_s / m_per_count
    # A wheel without a count in n reports moves less than 1 / n of a count in one: |moved| has a triangle's moments.
    # It may move further if the robot changes its rotation.
    if quiet > 0 and max(moved, moved_std) > 1.0 / (3.0 * quiet):
        change = abs(mean[OMEGA] - filter_.omega_radps) * abs(lever_m) * interval_s / m_per_count
        moved = max(1.0 / (3.0 * quiet), min(change, 1.0 / 3.0))
        moved_std = moved / math.sqrt(2.0)
    kept = _correlation(moved, moved_std)
    mean[state] = 0.5 * m_per_count + kept * (mean[state] - 0.5 * m_per_count)
    for other in range(STATES):
        cov[state, other] *= kept
    for other in range(STATES):
        cov[other, state] *= kept
    cov[state, state] += (1.0 - kept**2) * m_per_count**2 / 12.0


@compiled
def _is_turning(filter_: Any, model: Any, interval_s: float) -> Any:
    """Return whether rates since the stop differ from each other, or their mean differs from the bias.

    With such a mean, a robot would soon turn by more than a count of each wheel: without counts, the bias is wrong.
    """
    if filter_.is_turning or filter_.rates == 0:
        return filter_.is_turning > 0
    off_radps = abs(filter_.mean_rate_radps - filter_.mean[BIAS])
    variance = filter_.cov[BIAS, BIAS] + model.rate_variance / filter_.rates
    uncounted_rad = (model.m_per_count[0] + model.m_per_count[1]) / model.separation_m
    turned_rad = off_radps * min(filter_.quiet[0], filter_.quiet[1]) * interval_s
    return off_radps**2 > TURNING_STD**2 * variance and turned_rad < uncounted_rad


@compiled
def _count_error_m(filter_: Any, model: Any, wheel: int, total: int) -> Any:
    counted_m = (total - filter_.first_counts[wheel]) * model.m_per_count[wheel]
    return counted_m - filter_.mean[TRAVEL + wheel] + filter_.mean[REMAINDER + wheel]


@compiled
def _process_counts(filter_: Any, model: Any, stamp_ns: int, left: int, right: int) -> None:
    mean, totals = filter_.mean, (left, right)
    if filter_.counts_ns < 0:
        filter_.stamp_ns = filter_.counts_ns = stamp_ns
        for wheel in range(2):
            filter_.counts[wheel] = filter_.first_counts[wheel] = totals[wheel]
        return
    interval_s = 1e-9 * (stamp_ns - filter_.counts_ns)
    if not _advance(filter_, model, stamp_ns):
        # Move by the missed travel, at its mean speed.
        missed_s = 1e-9 * (stamp_ns - filter_.stamp_ns)
        left_m, right_m = _count_error_m(filter_, model, 0, left), _count_error_m(filter_, model, 1, right)
        mean[V] = 0.5 * (left_m + right_m) / missed_s
        mean[OMEGA] = (right_m - left_m) / (model.separation_m * missed_s)
        _move(filter_, model, missed_s)
        filter_.stamp_ns = stamp_ns
    is_moving = _is_turning(filter_, model, interval_s)
    for wheel in range(2):
        is_quiet = totals[wheel] == filter_.counts[wheel]
        is_moving = is_moving or not is_quiet
        filter_.quiet[wheel] = filter_.quiet[wheel] + 1 if is_quiet else 0
        _renew_remainder(filter_, model, wheel, interval_s)
    for wheel in range(2):
        slopes = np.zeros(STATES)
        slopes[TRAVEL + wheel], slopes[REMAINDER + wheel] = 1.0, -1.0
        slopes[DELAY] = (wheel - 0.5) * model.separation_m * mean[OMEGA]  # not of V, which is too noisy
        error_m = _count_error_m(filter_, model, wheel, totals[wheel])
        _correct(filter_, slopes, error_m, READING_VARIANCE * model.m_per_count[wheel] ** 2)
    for wheel in range(2):
        filter_.travel_m[wheel], filter_.counts[wheel] = mean[TRAVEL + wheel], totals[wheel]
    filter_.omega_radps = mean[OMEGA]
    filter_.counts_ns = stamp_ns
    if is_moving:
        _begin_rest(filter_)
    else:
        _rest(filter_, model, interval_s)


@compiled
def _begin_rest(filter_: Any) -> None:
    """Store the heading of a robot in motion, which may stop here."""
    filter_.standing = filter_.rates = filter_.is_turning = 0
    filter_.mean_rate_radps = 0.0
    filter_.mean[STOP_YAW] = filter_.mean[YAW]
    for other in range(STATES):
        filter_.cov[STOP_YAW, other] = filter_.cov[YAW, other]
    for other in range(STATES):
        filter_.cov[other, STOP_YAW] = filter_.cov[other, YAW]
    filter_.cov[STOP_YAW, STOP_YAW] += SETTLING_STD**2


@compiled
def _rest(filter_: Any, model: Any, interval_s: float) -> None:
    """Correct the speeds, and the heading, of a robot that has not moved for `standing_reports`."""
    filter_.standing += 1
    if filter_.standing < model.standing_reports:
        return
    m_per_count = min(model.m_per_count[0], model.m_per_count[1])
    v_variance = (m_per_count / (filter_.standing * interval_s)) ** 2 / 12.0  # at most one uncounted count since then
    _set_zero(filter_, V, v_variance)
    if filter_.rate_ns < 0 or filter_.counts_ns - filter_.rate_ns > model.gyro_timeout_ns:
        _set_zero(filter_, OMEGA, 4.0 * v_variance / model.separation_m**2)
        return
    _set_zero(filter_, OMEGA, REST_OMEGA_STD**2)
    slopes = np.zeros(STATES)
    slopes[YAW], slopes[STOP_YAW] = 1.0, -1.0
    _correct(filter_, slopes, filter_.mean[STOP_YAW] - filter_.mean[YAW], REST_YAW_STD**2)


@compiled(nogil=True)
def _run(
    filter_: Any, model: Any, stamps_ns: Array, rates: Array, report_ns: Array, counts: Array, means: Array, covs: Array
) -> None:
    """Process rates and counts in the order of their stamps."""
    sample = 0
    for report in range(len(report_ns)):
        while sample < len(stamps_ns) and stamps_ns[sample] <= report_ns[report]:
            _process_rate(filter_, model, stamps_ns[sample], rates[sample])
            sample += 1
        _process_counts(filter_, model, report_ns[report], counts[report, 0], counts[report, 1])
        means[report] = filter_.mean[:ESTIMATED]
        covs[report] = filter_.cov[:ESTIMATED, :ESTIMATED]
