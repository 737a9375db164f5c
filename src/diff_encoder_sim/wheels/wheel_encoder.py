"""Both incremental wheel encoders, from joint messages to pulse counts that are reported at a fixed rate.

Equation (1) of the paper, the counter's finite width, and the motor controller's 20 Hz report.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import Deque, Dict, Optional, Sequence, Tuple

from pydantic import Field, model_validator

from diff_encoder_sim.base.bounds import Rate_Hz, Seed
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.params import did_you_mean, not_allowed, param
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.wheels.counter import wrap_count
from diff_encoder_sim.wheels.encoder import SIDES, kinds_of, new_wheels, pulses_from_angle, turn
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, MOST_COUNTS_PER_TURN, CountingParams
from diff_encoder_sim.wheels.report_link import (
    DEFAULT_RATE_HZ,
    LATE_REPORT_TOLERANCE_NS,
    PROMPT,
    BoundarySampler,
    EncoderSample,
    ReportLink,
    ReportParams,
)

log = logging.getLogger(__name__)

# A wheel not named for this time is missing, not interleaved.
MISSING_AFTER_NS = NANOSECONDS_PER_SECOND

# Beyond any drive (100,000 km on a 0.2 m wheel); the pulses fit an int64.
LARGEST_ANGLE_RAD = 1e9

# After this number of messages without a newer stamp, the publisher does not set it.
STAMPS_STAND_STILL_AFTER = 100


class EncoderParams(CountingParams):
    """Parameters of gz_diff_encoder_node."""

    rate: Rate_Hz = param(DEFAULT_RATE_HZ, 'reports per second of joint stamps [Hz]')
    left_joint: str = Field('left_wheel_joint', min_length=1, description='name of the left wheel in /joint_states')
    right_joint: str = Field('right_wheel_joint', min_length=1, description='name of the right wheel in /joint_states')
    left_reversed: bool = param(False, 'the angle of the left joint falls when the robot drives forward')
    right_reversed: bool = param(False, 'the angle of the right joint falls when the robot drives forward')
    report: ReportParams = PROMPT
    seed: Seed = param(0, "of the encoders' errors: the trial's number")

    @property
    def is_ideal(self) -> bool:
        """Return whether counts follow from the angles at the boundaries of the rate by equation (1)."""
        is_exact = all(self.encoder.of_wheel(side) == IDEAL_ENCODER for side in SIDES)
        return is_exact and self.velocity_method == 'M' and not self.report.jitter

    @model_validator(mode='after')
    def _check_joints_differ(self) -> EncoderParams:
        if self.left_joint == self.right_joint:
            raise not_allowed('left_joint', self.left_joint, 'another joint than right_joint')
        return self

    @model_validator(mode='after')
    def _check_whole_turns(self) -> EncoderParams:
        """Check that uneven edges repeat with each turn of the sensor's shaft."""
        repeat, turns = self.encoder.counts_that_repeat, self.encoder.shaft_turns_per_wheel_turn
        for _, ppr in self.counts_per_turn if self.encoder.has_uneven_edges else ():
            counts = ppr / turns
            is_whole = abs(counts - round(counts)) <= 1e-6 * counts and round(counts) % repeat == 0
            if not is_whole or counts > MOST_COUNTS_PER_TURN:
                multiples = f'multiples of {repeat * turns:.9g} up to {MOST_COUNTS_PER_TURN * turns:.9g}'
                raise not_allowed('ppr', ppr, f'{multiples}, as edges are not even; or lines or pole_pairs of encoder')
        return self

    @model_validator(mode='after')
    def _check_order_of_reports(self) -> EncoderParams:
        """Check that odometry does not take a late report for the first of a new run."""
        parts_s, most_s = self.report.most_behind_s(1.0 / self.rate), LATE_REPORT_TOLERANCE_NS / NANOSECONDS_PER_SECOND
        behind_s = sum(parts_s.values())
        if behind_s > most_s:
            key = max(parts_s, key=lambda key: parts_s[key])
            behind = f'reports up to {most_s:g} s behind newer ones, not {behind_s:.4g} s as with this report and rate'
            given = getattr(self.report, key)
            raise not_allowed(f'report.{key}', given, f'{behind} {self.rate:g}; or stamps: arrival')
        return self


class _Wheel:
    """Stamps, sampling and pending samples of one wheel."""

    def __init__(self, params: EncoderParams, side: int) -> None:
        self.joint = (params.left_joint, params.right_joint)[side]
        self.sign = -1.0 if (params.left_reversed, params.right_reversed)[side] else 1.0
        self._ppr, self._measures = getattr(params.counts_per_turn, SIDES[side]), params.velocity_method != 'M'
        self.is_ideal = params.is_ideal
        if not self.is_ideal:
            self._kind = kinds_of(params)[side : side + 1]
            self.state = new_wheels(params.seed, 1)[0, side : side + 1]
            turn(self._kind, self.state.copy(), 0, 0.0, False)  # compile before the robot drives
        self._sampler = BoundarySampler(params.rate)
        self.timeline = Timeline(tolerance_ns=int(2 * NANOSECONDS_PER_SECOND / params.rate))
        self._jitters_ns = params.report.jitters_ns(1.0 / params.rate, params.seed).tolist()
        self._due: Deque[Tuple[int, int]] = deque()  # stamps and indices of the next samples
        self._last: Tuple[int, float] = (0, 0.0)  # stamp and angle
        # By period, while waiting for the other wheel: stamp, unwrapped count, measured speed.
        self.samples: Dict[int, Tuple[int, int, Optional[float]]] = {}

    def take(self, stamp_ns: int, angle_rad: float) -> Step:
        """Process an angle; after RESTART, replace the wheel by a new one."""
        step = self.timeline.advance(stamp_ns)
        if step is not Step.NEW:
            return step
        index = self._sampler.period_index(stamp_ns)
        if self.is_ideal:
            if index is not None:
                self.samples[index] = stamp_ns, int(pulses_from_angle(angle_rad, self._ppr)), None
            return step
        if index is not None:
            self._due.append((stamp_ns + self._jitters_ns[index % len(self._jitters_ns)], index))
        while self._due and self._due[0][0] <= stamp_ns:
            due_ns, due_index = self._due.popleft()
            due_rad, (last_ns, last_rad) = angle_rad, self._last
            if due_ns < stamp_ns:
                due_rad = last_rad + (due_ns - last_ns) / (stamp_ns - last_ns) * (angle_rad - last_rad)
            pulses, rate_radps = turn(self._kind, self.state, due_ns, due_rad, True)
            self.samples[due_index] = due_ns, pulses, rate_radps if self._measures else None
        turn(self._kind, self.state, stamp_ns, angle_rad, False)
        self._last = stamp_ns, angle_rad
        return step


class ReportingEncoder:
    """Encoders of both wheels on one motor controller that reports at a fixed rate over a link to the host.

    Joint messages may contain one or both wheels, in any order, with any other joints.
    """

    def __init__(self, params: EncoderParams) -> None:
        self.params = params
        self._link = None if params.report == PROMPT else ReportLink(params.report, 1.0 / params.rate, params.seed)
        self.reset()

    def reset(self) -> None:
        """Drop all samples; the next angle is each wheel's first, with the errors of the start."""
        self._wheels = _Wheel(self.params, 0), _Wheel(self.params, 1)
        self._first_stamp_ns: Optional[int] = None
        self._stale_in_a_row = 0

    @property
    def needs_every_angle(self) -> bool:
        """Return whether angles between report boundaries affect reports; False for an ideal encoder."""
        return self._link is not None or not self.params.is_ideal

    def take_command(self, left: float, right: float) -> None:
        """Set the commanded wheel speeds; encoders without direction count by their sign."""
        for wheel, speed in zip(self._wheels, (left, right)):
            if speed and not wheel.is_ideal:
                wheel.state['commanded'] = 1 if speed > 0.0 else -1

    def update(self, stamp_ns: int, names: Sequence[str], angles_rad: Sequence[float]) -> Sequence[EncoderSample]:
        """Process a joint message, and return the reports that arrive by its stamp.

        Args:
            stamp_ns: the message's stamp [ns].
            names: joint names.
            angles_rad: joint positions [rad], in the order of `names`.

        Raises:
            InputFault: a wheel has no finite angle, or is missing for long, or the stamps do not advance. The state is
                unchanged.
        """
        left, right = self._wheels
        left_rad, right_rad = _angle_of(left, names, angles_rad), _angle_of(right, names, angles_rad)
        if left_rad is None or right_rad is None:
            self._check_nothing_missing(stamp_ns, names)
        return self.step(stamp_ns, left_rad, right_rad)

    def step(self, stamp_ns: int, left_rad: Optional[float], right_rad: Optional[float]) -> Sequence[EncoderSample]:
        """Process the wheel angles [rad], None if missing, and return the reports that arrive by now.

        Raises:
            InputFault: the stamps do not advance.
        """
        both = zip(self._wheels, (left_rad, right_rad))
        steps = [wheel.take(stamp_ns, angle_rad) for wheel, angle_rad in both if angle_rad is not None]
        if Step.RESTART in steps:
            stamp_s = stamp_ns / NANOSECONDS_PER_SECOND
            log.warning('joint stamps went back to %.3f s: encoder restarted', stamp_s, extra=EVENT)
            self.reset()
            return self.step(stamp_ns, left_rad, right_rad)
        self._stale_in_a_row = 0 if Step.NEW in steps else self._stale_in_a_row + bool(steps)
        if self._stale_in_a_row >= STAMPS_STAND_STILL_AFTER:
            raise InputFault(
                f'stamps do not advance: {stamp_ns / NANOSECONDS_PER_SECOND:.3f} s in the last {self._stale_in_a_row} '
                f'messages; expected header.stamp to be the time of each sample'
            )
        sample = self._sample()
        if self._link is not None:
            return self._link.pass_on(stamp_ns, sample)
        return () if sample is None else (sample,)

    def _sample(self) -> Optional[EncoderSample]:
        """Remove and return the oldest period that both wheels have sampled, with all earlier periods."""
        left, right = self._wheels
        index = next((index for index in left.samples if index in right.samples), None)
        if index is None:
            return None
        (left_ns, left_pulses, left_radps), (right_ns, right_pulses, right_radps) = (
            wheel.samples[index] for wheel in self._wheels
        )
        for wheel in self._wheels:
            wheel.samples = {period: sample for period, sample in wheel.samples.items() if period > index}
        modulus = self.params.counter_modulus
        rates = None if left_radps is None or right_radps is None else (left_radps, right_radps)
        counts = wrap_count(left_pulses, modulus), wrap_count(right_pulses, modulus)
        return EncoderSample(max(left_ns, right_ns), *counts, rates)

    def _check_nothing_missing(self, stamp_ns: int, names: Sequence[str]) -> None:
        if self._first_stamp_ns is None:
            self._first_stamp_ns = stamp_ns
        for wheel in self._wheels:
            newest_ns = wheel.timeline.newest_ns
            missing_ns = stamp_ns - (self._first_stamp_ns if newest_ns is None else newest_ns)
            if wheel.joint not in names and missing_ns > MISSING_AFTER_NS:
                raise InputFault(
                    f'joint {wheel.joint!r} not seen for {missing_ns / NANOSECONDS_PER_SECOND:.1f} s; '
                    f'this message names {list(names)}{did_you_mean(wheel.joint, names)}'
                )


def _angle_of(wheel: _Wheel, names: Sequence[str], angles_rad: Sequence[float]) -> Optional[float]:
    """Return the angle, rising when the robot drives forward [rad]; None if the message does not name the joint."""
    if wheel.joint not in names:
        return None
    index = names.index(wheel.joint)
    angle_rad = angles_rad[index] if index < len(angles_rad) else math.nan
    if not abs(angle_rad) <= LARGEST_ANGLE_RAD:
        raise InputFault(f'joint {wheel.joint!r} has position {angle_rad}; expected a finite angle [rad]')
    return wheel.sign * angle_rad
