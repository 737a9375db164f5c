"""Odometry of wheels and a gyroscope: counters and samples of an IMU in any order of arrival, estimates at reports."""

from __future__ import annotations

import logging
import operator
from collections import deque
from typing import Any, Deque, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors, WheelGyroFilter
from diff_encoder_sim.localization.slip_detection import SlipDetector
from diff_encoder_sim.wheels.counter import PulseTotals
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import OdometryEstimate, TwistCovariance
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import LATE_REPORT_TOLERANCE_NS, BoundarySampler

log = logging.getLogger(__name__)

ImuReading = Tuple[int, str, float]  # stamp [ns], frame, angular velocity about the vertical axis [rad/s]
LARGEST_RATE_RADPS = 1000.0  # without a range of the gyroscope
LARGEST_BIAS_STD = 5.0  # of the estimated bias, in standard deviations by the parameters of the gyroscope
BAD_STAMPS = ('stamp', 'age', 'ahead')  # causes
RATED_SAMPLES, RATE_TOLERANCE = 100, 0.25  # of the measured rate of samples, relative
MOST_WAITING = 1000  # rates; older ones are dropped


class FusedOdometry:
    """Fuses reports of the counters and samples of an IMU; the first report is at pose zero.

    A report waits until all samples that are due at its stamp have arrived, by their rate and latency, so that the
    order of arrival does not change the estimates. Faulty samples are dropped with one warning for each cause: odometry
    continues with the wheels, and uses the gyroscope again from the next good sample, or after a wrong bias from the
    next reset. Without reports it continues with the gyroscope for `wheel_timeout`, and then reports no motion. While
    the wheels slip, up to 2 s, the heading is that of the gyroscope.
    """

    def __init__(self, params: FusionParams, odometry: OdometryParams, imu: ImuParams) -> None:
        self._params, self._axle_x_m = params, odometry.axle_x
        self._frames = list(dict.fromkeys((params.base_link_frame, imu.frame)))
        self._rate_hz = imu.rate
        self._latency_ns, self._due_after_ns = imu.latency_ns, imu.latency_ns + imu.period_ns
        self._wheel_timeout_ns = round(params.wheel_timeout * NANOSECONDS_PER_SECOND)
        self._gyro_timeout_ns = round(params.gyro_timeout * NANOSECONDS_PER_SECOND)
        self._largest_rate_radps = imu.gyroscope.range or LARGEST_RATE_RADPS
        self._largest_bias_radps = LARGEST_BIAS_STD * imu.gyroscope.bias_std
        self._pulses = PulseTotals(odometry.counter_limits)
        geometry = odometry.m_per_pulse, odometry.wheel_separation, odometry.travel_variance
        wheels = WheelErrors(*geometry, *odometry.geometry_std, odometry.axle_x, odometry.curve_noise or 0.0)
        self._filter, self.slip = WheelGyroFilter(params, wheels, imu), SlipDetector(params, wheels, imu)
        self.reset()

    def reset(self) -> None:
        """Return to pose zero; the next report is the start, and faults are reported again."""
        self._pulses.reset()
        self._filter.reset()
        self.slip.reset()
        self._rates: Deque[Tuple[int, float]] = deque(maxlen=MOST_WAITING)
        self._reports: Deque[Tuple[int, int, int]] = deque()  # that wait for rates
        self._sampler = BoundarySampler(self._params.frequency)
        self._of_wheels, self._of_imu = Timeline(LATE_REPORT_TOLERANCE_NS), Timeline(0)
        self._samples, self._first_sample_ns = 0, 0
        self._imu_at_report_ns = 0  # newest stamp of the IMU, or of the wheels, at the last report
        self._rates_until_ns: Optional[int] = None  # reports before this time need no more rates
        self._has_gyro, self._is_bias_wrong = True, False
        self._estimate_ns = -1  # newest stamp
        self._warned: Set[str] = set()

    def take_imu(self, stamp_ns: int, frame: str, yaw_rate_radps: float) -> List[OdometryEstimate]:
        """Process a sample, with the rate about the vertical axis; return the estimates that are due.

        Its stamp also shows when reports are overdue.
        """
        cause, text = self._fault(stamp_ns, frame, yaw_rate_radps)
        self._has_gyro = not cause
        if cause:
            self._warn_once(cause, f'IMU: {text}')
        if cause in BAD_STAMPS:
            self._rates.clear()
            self._samples = 0
            return self._released()
        if not cause:
            self._rates.append((stamp_ns, yaw_rate_radps))
            self._check_rate(stamp_ns)
            self._rates_until_ns = stamp_ns + self._due_after_ns
        return [*self._released(), *self._without_reports(stamp_ns)]

    def take_counts(self, stamp_ns: int, left_count: int, right_count: int) -> List[OdometryEstimate]:
        """Process a report of the counters, wrapped or not; return the estimates that are due.

        Stale reports are ignored. A stamp that jumps back resets odometry with a warning.
        """
        step = self._of_wheels.advance(stamp_ns)
        if step is Step.STALE:
            return []
        if step is Step.RESTART:
            stamp_s = stamp_ns / NANOSECONDS_PER_SECOND
            log.warning('encoder stamps went back to %.3f s: fusion restarted at pose zero', stamp_s, extra=EVENT)
            self.reset()
            self._of_wheels.advance(stamp_ns)
        if self._rates_until_ns is None:
            self._rates_until_ns = stamp_ns  # the first rates may still arrive
        if self._has_gyro and stamp_ns - self._rates_until_ns > self._gyro_timeout_ns:
            self._has_gyro = False
            self._warn_once('silence', f'IMU: no sample for {self._params.gyro_timeout:g} s')
        self._imu_at_report_ns = max(stamp_ns, self._of_imu.newest_ns or 0)
        self._reports.append(self._pulses.read(stamp_ns, left_count, right_count))
        return self._released()

    def run(
        self, samples: Iterable[Tuple[int, ImuReading]], reports: Iterable[Tuple[int, Sequence[int]]]
    ) -> Iterator[Tuple[int, OdometryEstimate]]:
        """Process samples and reports with their times of arrival; yield the estimates with the times they are due."""
        arrived: List[Tuple[int, bool, Sequence[Any]]] = [(time_ns, False, each) for time_ns, each in samples]
        arrived += [(time_ns, True, each) for time_ns, each in reports]
        for time_ns, is_report, given in sorted(arrived, key=operator.itemgetter(0, 1)):
            for estimate in (self.take_counts if is_report else self.take_imu)(*given):
                yield time_ns, estimate

    def _fault(self, stamp_ns: int, frame: str, yaw_rate_radps: float) -> Tuple[str, str]:
        """Return why a sample is not used: the cause, and a text; empty if it is good."""
        stamp_s, wheels_ns = stamp_ns / NANOSECONDS_PER_SECOND, self._of_wheels.newest_ns
        before_ns, longest_s = self._of_imu.newest_ns, self._params.gyro_timeout
        # Overdue reports do not put the IMU ahead, unless its stamp jumps.
        last_ns = max(wheels_ns or 0, before_ns or 0 if self._is_overdue(stamp_ns) else 0)
        if wheels_ns is not None and stamp_ns - last_ns > self._gyro_timeout_ns:
            return 'ahead', f'stamp {stamp_s:.3f} s; allowed: up to {longest_s:g} s after the counts'
        if self._of_imu.advance(stamp_ns) is not Step.NEW:
            return 'stamp', f'stamp {stamp_s:.3f} s; allowed: later than the one before'
        if wheels_ns is not None and wheels_ns - stamp_ns > self._gyro_timeout_ns:
            return 'age', f'stamp {stamp_s:.3f} s; allowed: up to {longest_s:g} s before the counts'
        if frame.lstrip('/') not in self._frames:
            return 'frame', f'frame {frame!r}; allowed: {" or ".join(self._frames)}'
        if not abs(yaw_rate_radps) <= self._largest_rate_radps:
            largest_radps = self._largest_rate_radps
            return 'rate', f'angular velocity {yaw_rate_radps:g} rad/s; allowed: up to {largest_radps:g} rad/s'
        return ('bias', 'wrong bias') if self._is_bias_wrong else ('', '')

    def _is_overdue(self, imu_ns: int) -> bool:
        """Return whether reports are overdue, by the clock of the IMU."""
        return imu_ns - self._imu_at_report_ns > self._wheel_timeout_ns

    def _check_rate(self, stamp_ns: int) -> None:
        self._samples += 1
        if self._samples == 1:
            self._first_sample_ns = stamp_ns
        elif self._samples == RATED_SAMPLES:
            rate_hz = (RATED_SAMPLES - 1) * NANOSECONDS_PER_SECOND / (stamp_ns - self._first_sample_ns)
            if abs(rate_hz / self._rate_hz - 1.0) > RATE_TOLERANCE:
                text = f'IMU: {rate_hz:.0f} samples per second; allowed: about its parameter rate, {self._rate_hz:g} Hz'
                self._warn_once('number', text, 'the covariance is wrong, and slip may not be detected')

    def _warn_once(self, cause: str, text: str, reaction: str = 'continuing with the wheels') -> None:
        if cause not in self._warned:
            self._warned.add(cause)
            log.warning('%s; %s (reported once)', text, reaction, extra=EVENT)

    def _released(self) -> List[OdometryEstimate]:
        """Process the reports that wait for no more rates."""
        estimates: List[OdometryEstimate] = []
        while self._reports and not (self._has_gyro and self._reports[0][0] >= (self._rates_until_ns or 0)):
            stamp_ns, left, right = self._reports.popleft()
            self._pass_rates(stamp_ns - self._latency_ns)
            self.slip.take_counts(stamp_ns, left, right)
            if self.slip.is_gyro_better:
                self._filter.take_slip()
            self._filter.take_counts(stamp_ns, left, right)
            estimates += self._due(stamp_ns)
        return estimates

    def _without_reports(self, stamp_ns: int) -> List[OdometryEstimate]:
        """Return an estimate without motion if reports are overdue at this time."""
        if self._of_wheels.newest_ns is None or self._reports or not self._is_overdue(stamp_ns):
            return []
        self._warn_once(
            'wheels', f'no counts for {self._params.wheel_timeout:g} s', 'reporting no motion until the next ones'
        )
        self._pass_rates(stamp_ns)
        self._filter.take_time(stamp_ns)
        return self._due(stamp_ns)

    def _pass_rates(self, until_ns: int) -> None:
        while self._rates and self._rates[0][0] <= until_ns:
            self.slip.take_gyro(*self._rates[0])
            self._filter.take_gyro(*self._rates.popleft())

    def _due(self, stamp_ns: int) -> List[OdometryEstimate]:
        """Return the estimate, or none before the end of the period; check the bias."""
        fused = self._filter.estimate
        bias_radps = float(fused.gyro_bias_radps)
        # Slip at the start of a fast rotation also looks like a bias, until the robot rests.
        is_known = self._filter.is_at_rest or self.slip.state.is_slipping
        if is_known and not self._is_bias_wrong and abs(bias_radps) > self._largest_bias_radps > 0.0:
            self._is_bias_wrong, self._has_gyro = True, False
            self._rates.clear()
            given = f'IMU: estimated bias {bias_radps:.3g} rad/s; allowed: up to {self._largest_bias_radps:.3g} rad/s'
            self._warn_once('bias', given, 'continuing with the wheels until a reset')
        if stamp_ns <= self._estimate_ns or self._sampler.period_index(stamp_ns) is None:
            return []
        self._estimate_ns = stamp_ns
        (xx, xy, x_yaw), (_, yy, y_yaw), (*_, yaw_yaw) = fused.pose_covariance.tolist()
        (of_linear, together), (_, of_angular) = fused.twist_covariance.tolist()
        linear_mps, angular_radps = fused.twist.tolist()
        return [
            OdometryEstimate(
                stamp_ns,
                Pose2D(*fused.pose.tolist()),
                linear_mps,
                angular_radps,
                PlanarCovariance(xx, xy, x_yaw, yy, y_yaw, yaw_yaw),
                TwistCovariance(of_linear, together, of_angular),
                0.0 - self._axle_x_m * angular_radps,  # never -0.0
            )
        ]
