"""Both incremental wheel encoders, from joint messages to pulse counts that are reported at a fixed rate.

Equation (1) of the paper, the counter's finite width, and the motor controller's 20 Hz report.
"""

from __future__ import annotations

import logging
from typing import NamedTuple, Optional, Sequence

from pydantic import Field, model_validator

from diff_encoder_sim.base.bounded_numbers import Rate_Hz
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step
from diff_encoder_sim.base.typed_params import Params, did_you_mean
from diff_encoder_sim.encoders.counter import CounterModulus, wrap_count
from diff_encoder_sim.encoders.pulses import DEFAULT_PPR, PulsesPerRevolution
from diff_encoder_sim.encoders.sampling import DEFAULT_RATE_HZ
from diff_encoder_sim.encoders.wheel_channel import MISSING_AFTER_NS, WheelChannel

log = logging.getLogger(__name__)

# Far beyond any drive (100,000 km on a 0.2 m wheel), and its pulses still fit an int64.
LARGEST_ANGLE_RAD = 1e9

# After so many messages in a row without a newer stamp, the publisher does not set it.
STAMPS_STAND_STILL_AFTER = 100


class EncoderParams(Params):
    """Parameters of gz_diff_encoder_node, under the names that users set."""

    ppr: PulsesPerRevolution = DEFAULT_PPR
    rate: Rate_Hz = Field(DEFAULT_RATE_HZ, description='reports per second of joint stamps [Hz]')
    left_joint: str = Field('left_wheel_joint', min_length=1, description='name of the left wheel in /joint_states')
    right_joint: str = Field('right_wheel_joint', min_length=1, description='name of the right wheel in /joint_states')
    left_reversed: bool = Field(False, description='the angle of the left joint falls when the robot drives forward')
    right_reversed: bool = Field(False, description='the angle of the right joint falls when the robot drives forward')
    counter_modulus: CounterModulus = 0

    @model_validator(mode='after')
    def _check_joints_differ(self) -> EncoderParams:
        if self.left_joint == self.right_joint:
            raise ValueError('left_joint and right_joint that differ')
        return self


class EncoderSample(NamedTuple):
    """The counters as read at one instant."""

    stamp_ns: int
    left_pulses: int
    right_pulses: int


class DiffEncoder:
    """Both wheels' encoders behind one motor controller that reports at a fixed rate.

    It takes every joint message. The wheels may come in one message or in several, in any order,
    among any other joints.
    """

    def __init__(self, params: EncoderParams) -> None:
        self.params = params
        self.reset()

    def reset(self) -> None:
        """Drop all samples; counts are still those of equation (1) at the wheel's angle."""
        params = self.params
        self._left = WheelChannel(params.left_joint, params.ppr.left, params.rate)
        self._right = WheelChannel(params.right_joint, params.ppr.right, params.rate)
        self._channels = self._left, self._right
        self._signs = -1.0 if params.left_reversed else 1.0, -1.0 if params.right_reversed else 1.0
        self._first_stamp_ns: Optional[int] = None
        self._stale_in_a_row = 0

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
        return EncoderSample(stamp_ns, wrap_count(left.pulses, modulus), wrap_count(right.pulses, modulus))

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
