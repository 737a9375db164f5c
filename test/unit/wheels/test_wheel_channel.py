"""One wheel behind the motor controller."""

import math

import pytest

from diff_encoder_sim.base.stamps import Step
from diff_encoder_sim.wheels.encoder import IdealWheel
from diff_encoder_sim.wheels.wheel_encoder import MISSING_AFTER_NS, WheelChannel

MS = 1_000_000


def test_a_count_is_taken_at_each_boundary_with_the_stamp_of_its_angle():
    channel = WheelChannel('wheel', IdealWheel(90), 20.0)
    for stamp_ms in range(0, 130, 20):
        assert channel.take(stamp_ms * MS, math.radians(2.0 + 4.0 * stamp_ms)) is Step.NEW  # a pulse per millisecond
    found = {period: sample[:2] for period, sample in channel.samples.items()}
    assert found == {0: (0, 0), 1: (60 * MS, 60), 2: (100 * MS, 100)}
    assert channel.last_seen_ns == 120 * MS


@pytest.mark.parametrize(('stamp_ms', 'step'), [(1000, Step.STALE), (900, Step.STALE), (899, Step.RESTART)])
def test_a_stamp_that_is_not_newer_gives_no_sample(stamp_ms, step):
    channel = WheelChannel('wheel', IdealWheel(90), 20.0)
    channel.take(1000 * MS, 0.0)
    assert channel.take(stamp_ms * MS, 1.0) is step
    assert list(channel.samples) == [20]


def test_samples_are_kept_for_as_long_as_the_other_wheel_may_be_late():
    channel = WheelChannel('wheel', IdealWheel(90), 20.0)
    for period in range(1000):
        channel.take(period * 50 * MS, 0.0)
    stamps_ns = [sample.stamp_ns for sample in channel.samples.values()]
    assert MISSING_AFTER_NS <= stamps_ns[-1] - stamps_ns[0] <= MISSING_AFTER_NS + 100 * MS
    channel.drop_before(999)
    assert list(channel.samples) == [999]
