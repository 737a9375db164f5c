"""Both incremental wheel encoders, from joint messages to pulse counts that are reported at a fixed rate.

Equation (1) of the paper, the counter's finite width, and the motor controller's 20 Hz report.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import Any, Deque, Dict, NamedTuple, Optional, Sequence, Tuple, Union

from pydantic import Field, model_validator

from diff_encoder_sim.base.bounds import Rate_Hz, Seed
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.params import Params, did_you_mean, not_allowed
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.wheels.encoder import CountingWheel, IdealWheel
from diff_encoder_sim.wheels.encoder_params import (
    DEFAULT_PPR,
    IDEAL_ENCODER,
    MOST_COUNTS_PER_TURN,
    CounterModulus,
    EncoderModel,
    PerWheel,
    PulsesPerRevolution,
    counts_per_turn,
    wrap_count,
)
from diff_encoder_sim.wheels.report_link import (
    LATE_REPORT_TOLERANCE_NS,
    PROMPT,
    EncoderSample,
    ReportLink,
    ReportParams,
)
from diff_encoder_sim.wheels.sampling import DEFAULT_RATE_HZ, BoundarySampler
from diff_encoder_sim.wheels.wheel_rate import DEFAULT_CLOCK_HZ, VelocityClock_Hz, VelocityMethod, WheelRate

# A wheel that no message has named for this long is missing, not merely interleaved.
MISSING_AFTER_NS = NANOSECONDS_PER_SECOND


class WheelSample(NamedTuple):
    """The wheel's count at one instant, before the counter wraps it."""

    stamp_ns: int
    pulses: int
    rate_radps: Optional[float] = None  # None where the controller measures no speed


class WheelChannel:
    """A wheel's stamps, its sampling, and its samples that are not yet reported."""

    def __init__(
        self, joint: str, wheel: Union[IdealWheel, CountingWheel], rate_hz: float, jitters_ns: Sequence[int] = ()
    ) -> None:
        """Prepare to sample a wheel.

        Args:
            joint: its name.
            wheel: turned by the angles.
            rate_hz: of the samples.
            jitters_ns: how much later than the first stamp at its boundary a sample is taken, by its index, again
                and again; less than the period. None: at that stamp.
        """
        self.joint = joint
        self.wheel = wheel
        self._sampler = BoundarySampler(rate_hz)
        self._timeline = Timeline(tolerance_ns=int(2 * NANOSECONDS_PER_SECOND / rate_hz))
        self._jitters_ns = jitters_ns
        self._due: Deque[Tuple[int, int]] = deque()  # stamps and indices of samples that jitter has put off
        self._last: Optional[Tuple[int, float]] = None  # stamp and angle
        self.samples: Dict[int, WheelSample] = {}  # by period, for as long as the other wheel may be late
        self._kept_periods = math.ceil(MISSING_AFTER_NS * rate_hz / NANOSECONDS_PER_SECOND) + 1

    def take(self, stamp_ns: int, angle_rad: float) -> Step:
        """Feed one angle; after RESTART the channel must be replaced by a new one."""
        step = self._timeline.advance(stamp_ns)
        if step is Step.NEW:
            index = self._sampler.period_index(stamp_ns)
            if self._jitters_ns:
                self._sample_late(stamp_ns, angle_rad, index)
            self.wheel.turn_to(stamp_ns, angle_rad)
            if index is not None and not self._jitters_ns:
                self._sample(stamp_ns, index)
        return step

    def _sample_late(self, stamp_ns: int, angle_rad: float, index: Optional[int]) -> None:
        """Take the samples that are due by now, at angles between the last one and this."""
        while self._due and self._last and self._due[0][0] < stamp_ns:
            due_ns, due_index = self._due.popleft()
            last_ns, last_rad = self._last
            passed = (due_ns - last_ns) / (stamp_ns - last_ns)
            self.wheel.turn_to(due_ns, last_rad + passed * (angle_rad - last_rad))
            self._sample(due_ns, due_index)
        if index is not None:
            self._due.append((stamp_ns + self._jitters_ns[index % len(self._jitters_ns)], index))
        self._last = stamp_ns, angle_rad

    def _sample(self, stamp_ns: int, index: int) -> None:
        self.samples[index] = WheelSample(stamp_ns, self.wheel.count(), self.wheel.rate_radps(stamp_ns))
        self.drop_before(index - self._kept_periods)

    def drop_before(self, period_index: int) -> None:
        """Drop the samples of periods before this one."""
        while self.samples and next(iter(self.samples)) < period_index:
            del self.samples[next(iter(self.samples))]

    @property
    def last_seen_ns(self) -> Optional[int]:
        """Stamp of the newest angle taken."""
        return self._timeline.newest_ns


log = logging.getLogger(__name__)

# Far beyond any drive (100,000 km on a 0.2 m wheel), and its pulses still fit an int64.
LARGEST_ANGLE_RAD = 1e9

# After so many messages in a row without a newer stamp, the publisher does not set it.
STAMPS_STAND_STILL_AFTER = 100

# So many draws of samples' jitter, then again.
JITTERS = 1024


class EncoderParams(Params):
    """Parameters of gz_diff_encoder_node, under the names that users set."""

    ppr: PulsesPerRevolution = DEFAULT_PPR
    rate: Rate_Hz = Field(DEFAULT_RATE_HZ, description='reports per second of joint stamps [Hz]')
    left_joint: str = Field('left_wheel_joint', min_length=1, description='name of the left wheel in /joint_states')
    right_joint: str = Field('right_wheel_joint', min_length=1, description='name of the right wheel in /joint_states')
    left_reversed: bool = Field(False, description='the angle of the left joint falls when the robot drives forward')
    right_reversed: bool = Field(False, description='the angle of the right joint falls when the robot drives forward')
    counter_modulus: CounterModulus = 0
    encoder: EncoderModel = IDEAL_ENCODER
    report: ReportParams = PROMPT
    velocity_method: VelocityMethod = 'M'
    velocity_clock: VelocityClock_Hz = DEFAULT_CLOCK_HZ
    seed: Seed = Field(0, description="of the encoders' errors: the trial's number")

    @model_validator(mode='after')
    def _check_joints_differ(self) -> EncoderParams:
        if self.left_joint == self.right_joint:
            raise not_allowed('left_joint', self.left_joint, 'another joint than right_joint')
        return self

    @model_validator(mode='after')
    def _check_whole_turns(self) -> EncoderParams:
        """Check that edges which are not even can repeat with the turns of the sensor's shaft."""
        model, ppr = self.encoder, self.counts_per_turn
        if not model.has_uneven_edges:
            return self
        for wheel in (ppr.left, ppr.right):
            counts = wheel / model.shaft_turns_per_wheel_turn
            is_whole = abs(counts - round(counts)) <= 1e-6 * counts and round(counts) % model.counts_that_repeat == 0
            if not is_whole or counts > MOST_COUNTS_PER_TURN:
                turns = model.shaft_turns_per_wheel_turn
                step, most = f'{model.counts_that_repeat * turns:.9g}', f'{MOST_COUNTS_PER_TURN * turns:.9g}'
                raise not_allowed(
                    'ppr',
                    wheel,
                    f'multiples of {step} up to {most}, as edges are not even; or lines or pole_pairs of encoder',
                )
        return self

    @model_validator(mode='after')
    def _check_order_of_reports(self) -> EncoderParams:
        """Check that no late report is so far behind that odometry takes it for the first of a new run."""
        parts_s, most_s = self.report.most_behind_s(1.0 / self.rate), LATE_REPORT_TOLERANCE_NS / NANOSECONDS_PER_SECOND
        behind_s = sum(parts_s.values())
        if behind_s > most_s:
            key = max(parts_s, key=lambda key: parts_s[key])
            raise not_allowed(
                f'report.{key}',
                getattr(self.report, key),
                f'reports up to {most_s:g} s behind newer ones, not {behind_s:.4g} s as with this report and rate '
                f'{self.rate:g}; or stamps: arrival',
            )
        return self

    @property
    def counts_per_turn(self) -> PerWheel:
        """Return the counts per wheel revolution: the encoder's, where it says them, else `ppr`."""
        return counts_per_turn(self.ppr, self.encoder)

    def values_in_use(self) -> Dict[str, Any]:
        """Return the values by key, with the encoder's own resolution."""
        return {**super().values_in_use(), 'ppr': self.counts_per_turn.plain}


class DiffEncoder:
    """Both wheels' encoders behind one motor controller that reports at a fixed rate.

    It takes every joint message. The wheels may come in one message or in several, in any order,
    among any other joints.
    """

    def __init__(self, params: EncoderParams) -> None:
        self.params, self.counts_per_turn = params, params.counts_per_turn
        self.reset()

    def reset(self) -> None:
        """Drop all samples; the next angle is each wheel's first, and its errors are drawn as at the start."""
        params, ppr = self.params, self.counts_per_turn
        jitters_ns = self._jitters_ns()
        self._left, self._right = (
            WheelChannel(joint, self._wheel(side, counts), params.rate, jitters_ns)
            for joint, side, counts in ((params.left_joint, 'left', ppr.left), (params.right_joint, 'right', ppr.right))
        )
        self._channels = self._left, self._right
        self._signs = -1.0 if params.left_reversed else 1.0, -1.0 if params.right_reversed else 1.0
        self._first_stamp_ns: Optional[int] = None
        self._stale_in_a_row = 0

    def _wheel(self, side: str, ppr: float) -> Union[IdealWheel, CountingWheel]:
        params = self.params
        model = params.encoder.of_wheel(side)
        if model == IDEAL_ENCODER and params.velocity_method == 'M':
            return IdealWheel(ppr)
        rate = None
        if params.velocity_method != 'M':
            rate = WheelRate(params.velocity_method, 2.0 * math.pi / ppr, params.velocity_clock)
        return CountingWheel(model, ppr, generator(params.seed, f'{side}_encoder'), rate)

    def _jitters_ns(self) -> Tuple[int, ...]:
        """Draw how late samples are: the same for both wheels, which one controller reads."""
        jitter_s = self.params.report.jitter_within_s(1.0 / self.params.rate)
        if not jitter_s:
            return ()
        drawn_s = generator(self.params.seed, 'encoder_jitter').uniform(0.0, jitter_s, JITTERS)
        return tuple(round(late_s * NANOSECONDS_PER_SECOND) for late_s in drawn_s)

    @property
    def has_ideal_wheels(self) -> bool:
        """Return whether both follow equation (1), at each instant for itself."""
        return all(isinstance(channel.wheel, IdealWheel) for channel in self._channels)

    def take_command(self, left: float, right: float) -> None:
        """Take the commanded speeds of the wheels, whose signs are those of counts without a direction of their own."""
        for channel, speed in ((self._left, left), (self._right, right)):
            if isinstance(channel.wheel, CountingWheel):
                channel.wheel.command((speed > 0.0) - (speed < 0.0))

    def update(self, stamp_ns: int, names: Sequence[str], angles_rad: Sequence[float]) -> Optional[EncoderSample]:
        """Take one joint message, and return a sample when both wheels have reached a boundary.

        Args:
            stamp_ns: the message's stamp [ns].
            names: joint names.
            angles_rad: joint positions [rad], in the order of `names`.

        Raises:
            InputFault: a wheel is named twice, has no finite angle, or has long been missing, or
                the stamps do not advance. The state stays as before.
        """
        angles = [_angle_of(channel.joint, names, angles_rad) for channel in self._channels]
        steps = [
            channel.take(stamp_ns, sign * angle)
            for channel, sign, angle in zip(self._channels, self._signs, angles)
            if angle is not None
        ]
        if Step.RESTART in steps:
            log.warning(
                'joint stamps went back to %.3f s: encoder restarted', stamp_ns / NANOSECONDS_PER_SECOND, extra=EVENT
            )
            self.reset()
            return self.update(stamp_ns, names, angles_rad)
        self._check_stamps_advance(stamp_ns, steps)
        if len(steps) < len(self._channels):
            self._check_nothing_missing(stamp_ns, names)
        return self._report()

    def _report(self) -> Optional[EncoderSample]:
        """Return the oldest period that both wheels have a sample of, and drop it and those before."""
        if not (self._left.samples and self._right.samples):
            return None
        index = next((index for index in self._left.samples if index in self._right.samples), None)
        if index is None:
            return None
        left, right = self._left.samples[index], self._right.samples[index]
        for channel in self._channels:
            channel.drop_before(index + 1)
        modulus = self.params.counter_modulus
        stamp_ns = max(left.stamp_ns, right.stamp_ns)
        counts = wrap_count(left.pulses, modulus), wrap_count(right.pulses, modulus)
        if left.rate_radps is None or right.rate_radps is None:
            return EncoderSample(stamp_ns, *counts)
        return EncoderSample(stamp_ns, *counts, (left.rate_radps, right.rate_radps))

    def _check_stamps_advance(self, stamp_ns: int, steps: Sequence[Step]) -> None:
        if Step.NEW in steps:
            self._stale_in_a_row = 0
        elif steps:
            self._stale_in_a_row += 1
        if self._stale_in_a_row >= STAMPS_STAND_STILL_AFTER:
            raise InputFault(
                f'stamps do not advance: {stamp_ns / NANOSECONDS_PER_SECOND:.3f} s in the last {self._stale_in_a_row} '
                f'messages; expected header.stamp to be the time of each sample'
            )

    def _check_nothing_missing(self, stamp_ns: int, names: Sequence[str]) -> None:
        if self._first_stamp_ns is None:
            self._first_stamp_ns = stamp_ns
        for channel in self._channels:
            last_seen_ns = self._first_stamp_ns if channel.last_seen_ns is None else channel.last_seen_ns
            missing_ns = stamp_ns - last_seen_ns
            if channel.joint not in names and missing_ns > MISSING_AFTER_NS:
                raise InputFault(
                    f'joint {channel.joint!r} not seen for {missing_ns / NANOSECONDS_PER_SECOND:.1f} s; '
                    f'this message names {list(names)}{did_you_mean(channel.joint, names)}'
                )


class ReportingEncoder:
    """The encoders, and the way of their reports to the host: what the node, a lockstep trial and `reencode` run."""

    def __init__(self, params: EncoderParams) -> None:
        self._encoder = DiffEncoder(params)
        self._link: Optional[ReportLink] = None
        if params.report != PROMPT:
            self._link = ReportLink(params.report, 1.0 / params.rate, generator(params.seed, 'encoder_reports'))

    @property
    def needs_every_angle(self) -> bool:
        """Return whether angles between the boundaries of the rate count, or their stamps: not of an ideal encoder."""
        return self._link is not None or not self._encoder.has_ideal_wheels

    def take_command(self, left: float, right: float) -> None:
        """Take the commanded speeds of the wheels; see `DiffEncoder`."""
        self._encoder.take_command(left, right)

    def update(self, stamp_ns: int, names: Sequence[str], angles_rad: Sequence[float]) -> Sequence[EncoderSample]:
        """Take one joint message as `DiffEncoder.update` does, and return the reports that arrive by its stamp."""
        sample = self._encoder.update(stamp_ns, names, angles_rad)
        if self._link is not None:
            return self._link.pass_on(stamp_ns, sample)
        return () if sample is None else (sample,)


def _angle_of(joint: str, names: Sequence[str], angles_rad: Sequence[float]) -> Optional[float]:
    """Return the joint's angle [rad], or None where the message does not name it."""
    times_named = names.count(joint)
    if times_named == 0:
        return None
    if times_named > 1:
        raise InputFault(f'joint {joint!r} is named {times_named} times in one message')
    index = names.index(joint)
    if index >= len(angles_rad):
        raise InputFault(f'joint {joint!r} has no position: {len(names)} names, {len(angles_rad)} positions')
    if not abs(angles_rad[index]) <= LARGEST_ANGLE_RAD:
        raise InputFault(f'joint {joint!r} has position {angles_rad[index]}; expected a finite angle [rad]')
    return angles_rad[index]
