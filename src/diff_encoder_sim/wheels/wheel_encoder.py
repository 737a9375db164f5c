"""Both incremental wheel encoders, from joint messages to pulse counts that are reported at a fixed rate.

Equation (1) of the paper, the counter's finite width, and the motor controller's 20 Hz report.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import Deque, List, Optional, Sequence, Tuple

import numpy as np
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
MISSING_AFTER_S = 1.0

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


class ReportingEncoder:
    """Encoders of both wheels on one motor controller that reports at a fixed rate over a link to the host.

    Joint messages may contain one or both wheels, in any order, with any other joints.
    """

    def __init__(self, params: EncoderParams) -> None:
        self.params, self._ppr = params, (params.counts_per_turn.left, params.counts_per_turn.right)
        self._joints = (params.left_joint, params.left_reversed), (params.right_joint, params.right_reversed)
        self._link = None if params.report == PROMPT else ReportLink(params.report, 1.0 / params.rate, params.seed)
        self._jitters_ns = params.report.jitters_ns(1.0 / params.rate, params.seed).tolist()
        self._kinds = None if params.is_ideal else kinds_of(params)
        if self._kinds is not None:
            turn(self._kinds, new_wheels(params.seed, 1)[0], 0, 0.0, 0.0, False)  # compile before the robot drives
        self.reset()

    def reset(self) -> None:
        """Drop all samples; the next angle is each wheel's first, with the errors of the start."""
        params = self.params
        self._wheels = new_wheels(params.seed, 1)[0]
        self._timeline = Timeline(tolerance_ns=int(2 * NANOSECONDS_PER_SECOND / params.rate))
        self._sampler = BoundarySampler(params.rate)
        self._due_ns: Deque[int] = deque()  # times of the next readings
        self._last = (0, 0.0, 0.0)  # stamp and angles
        self._stale_in_a_row = 0
        self._seen_ns: Optional[int] = None  # stamp of the newest message with both wheels, or of the first message
        # Newest stamps and angles of each wheel in separate messages.
        self._newest: Tuple[Deque[Tuple[int, float]], ...] = (deque(), deque())

    @property
    def needs_every_angle(self) -> bool:
        """Return whether angles between report boundaries affect reports; False for an ideal encoder."""
        return self._link is not None or self._kinds is not None

    def take_command(self, left: float, right: float) -> None:
        """Set the commanded wheel speeds; encoders without direction count by their sign."""
        for wheel, speed in enumerate((left, right)):
            if speed:
                self._wheels['commanded'][wheel] = 1 if speed > 0.0 else -1

    def update(self, stamp_ns: int, names: Sequence[str], angles_rad: Sequence[float]) -> Sequence[EncoderSample]:
        """Process a joint message, and return the reports that arrive by its stamp.

        Wheels in separate messages are interpolated at the newest time that both have reached. `names` are those of
        the joints. InputFault, without effect, if a wheel has no finite angle, or is missing for long, or the stamps do
        not advance.
        """
        self._seen_ns = stamp_ns if self._seen_ns is None else self._seen_ns
        found: List[Optional[float]] = []
        for (joint, is_reversed), samples in zip(self._joints, self._newest):
            if joint in names:
                index = names.index(joint)
                angle_rad = angles_rad[index] if index < len(angles_rad) else math.nan
                if not abs(angle_rad) <= LARGEST_ANGLE_RAD:
                    raise InputFault(f'joint {joint!r} has position {angle_rad}; expected a finite angle [rad]')
                found.append(-angle_rad if is_reversed else angle_rad)
                continue
            found.append(None)
            missing_s = (stamp_ns - max([self._seen_ns, *(each_ns for each_ns, _ in samples)])) / NANOSECONDS_PER_SECOND
            if missing_s > MISSING_AFTER_S:
                raise InputFault(
                    f'joint {joint!r} not seen for {missing_s:.1f} s; '
                    f'this message names {list(names)}{did_you_mean(joint, names)}'
                )
        left_rad, right_rad = found
        if left_rad is not None and right_rad is not None:
            self._seen_ns = stamp_ns
            return self.step(stamp_ns, left_rad, right_rad)
        for found_rad, samples in zip(found, self._newest):
            if found_rad is not None:
                if samples and stamp_ns < samples[-1][0]:  # time went back
                    self._newest = deque(), deque()
                    return self.update(stamp_ns, names, angles_rad)
                samples.append((stamp_ns, found_rad))
        left, right = self._newest
        now_ns = min(left[-1][0], right[-1][0]) if left and right else 0
        if not (left and right) or now_ns < max(left[0][0], right[0][0]) or now_ns == self._timeline.newest_ns:
            return ()
        both_rad = []
        for samples in self._newest:
            while len(samples) > 1 and samples[1][0] <= now_ns:
                samples.popleft()
            stamps_ns, sampled_rad = zip(*samples)
            both_rad.append(float(np.interp(now_ns, stamps_ns, sampled_rad)))
        return self.step(now_ns, *both_rad)

    def step(self, stamp_ns: int, left_rad: float, right_rad: float) -> Sequence[EncoderSample]:
        """Process accumulated angles of both wheels [rad]; return arriving reports. InputFault for a stale stamp."""
        step = self._timeline.advance(stamp_ns)
        if step is Step.RESTART:
            stamp_s = stamp_ns / NANOSECONDS_PER_SECOND
            log.warning('joint stamps went back to %.3f s: encoder restarted', stamp_s, extra=EVENT)
            self.reset()
            return self.step(stamp_ns, left_rad, right_rad)
        self._stale_in_a_row = 0 if step is Step.NEW else self._stale_in_a_row + 1
        if self._stale_in_a_row >= STAMPS_STAND_STILL_AFTER:
            raise InputFault(
                f'stamps do not advance: {stamp_ns / NANOSECONDS_PER_SECOND:.3f} s in the last {self._stale_in_a_row} '
                f'messages; expected header.stamp to be the time of each sample'
            )
        samples = self._samples(stamp_ns, left_rad, right_rad) if step is Step.NEW else ()
        return samples if self._link is None else self._link.pass_on(stamp_ns, samples)

    def _samples(self, stamp_ns: int, left_rad: float, right_rad: float) -> Sequence[EncoderSample]:
        """Turn the wheels, and return the readings up to now."""
        index, modulus = self._sampler.period_index(stamp_ns), self.params.counter_modulus
        if self._kinds is None:
            if index is None:
                return ()
            left, right = (int(pulses_from_angle(*each)) for each in zip((left_rad, right_rad), self._ppr))
            return (EncoderSample(stamp_ns, wrap_count(left, modulus), wrap_count(right, modulus)),)
        if index is not None:
            self._due_ns.append(stamp_ns + self._jitters_ns[index % len(self._jitters_ns)])
        samples = []
        last_ns, last_left_rad, last_right_rad = self._last
        while self._due_ns and self._due_ns[0] <= stamp_ns:
            due_ns, both_rad = self._due_ns.popleft(), (left_rad, right_rad)
            if due_ns < stamp_ns:
                passed = (due_ns - last_ns) / (stamp_ns - last_ns)
                left_due_rad = last_left_rad + passed * (left_rad - last_left_rad)
                both_rad = left_due_rad, last_right_rad + passed * (right_rad - last_right_rad)
            left, right, *rates_radps = turn(self._kinds, self._wheels, due_ns, *both_rad, True)
            rates = None if self.params.velocity_method == 'M' else (rates_radps[0], rates_radps[1])
            samples.append(EncoderSample(due_ns, wrap_count(left, modulus), wrap_count(right, modulus), rates))
        turn(self._kinds, self._wheels, stamp_ns, left_rad, right_rad, False)
        self._last = stamp_ns, left_rad, right_rad
        return samples
