"""At which stamps of odometry the navigator controls."""

import numpy as np
import pytest

from diff_encoder_sim.navigation.navigator_inputs import ControlRate

MS = 1_000_000


def controlled_ms(stamps_ms, frequency_hz=20.0):
    rate = ControlRate(frequency_hz)
    return [stamp for stamp in stamps_ms if rate.is_due(round(stamp * MS))]


@pytest.mark.parametrize('odometry_hz', [25, 30, 40, 50, 100, 200, 1000])
def test_faster_odometry_is_controlled_at_the_rate(odometry_hz):
    stamps = np.arange(0, 10_000, 1000 / odometry_hz)
    due = controlled_ms(stamps)
    assert len(due) == pytest.approx(200, abs=1)
    # Only the first period may be half a one; then they are as regular as the stamps that come.
    assert np.abs(np.diff(due)[1:] - 50.0).max() <= 1000 / odometry_hz


@pytest.mark.parametrize('odometry_hz', [1, 5, 10, 15, 19])
def test_slower_odometry_is_controlled_each_time(odometry_hz):
    stamps = list(np.arange(0, 10_000, 1000 / odometry_hz))
    assert controlled_ms(stamps) == stamps


def test_jitter_is_never_skipped():
    """The encoder samples at the first joint state after each boundary: up to 20 ms late."""
    random = np.random.default_rng(1)
    stamps = list(50.0 * np.arange(1000) + random.uniform(0.0, 20.0, 1000))
    assert controlled_ms(stamps) == stamps


def test_gaps_and_time_that_goes_back_begin_a_new_period():
    assert controlled_ms([0, 10, 50, 3000, 3010, 3050, 200, 210, 250]) == [0, 50, 3000, 3050, 200, 250]
    assert controlled_ms([100, 100, 90]) == [100]  # repeated, overtaken
