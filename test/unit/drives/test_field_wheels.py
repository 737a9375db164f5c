"""Wheel angles from any two numbers: of one topic, of two that are paired, and with times of receipt."""

import numpy as np
import pytest

from reencoding_drives import TICK_NS, angles_rad
from reencoding_runs import counts_of, run, samples_of
from reencoding_sources import (
    COUNT,
    Bag,
    arrays,
    create3,
    duckietown,
    instants,
    jackal,
    kobuki,
    ticks,
    turtlebot3,
    two_topics,
)

TICKS = ('--ticks-per-revolution',)


def std(bits, kind):
    return lambda: two_topics(1024, f'std_msgs/msg/{kind}', bits)


def reencoded(tmp_path, bag, arguments, ppr=64):
    """The counts that the re-encoded bag has."""
    path = bag.write(tmp_path / ('a' if bag.is_ros2 else 'a.bag'))
    run(path, *arguments, '--ppr', ppr, '--out', tmp_path / 'out')
    return counts_of(tmp_path / 'out' / f'a_{ppr}ppr.bag')


@pytest.mark.parametrize(
    ('make', 'sides', 'recorded_ppr'),
    [
        (std(16, 'Int16'), ['/lwheel', '/rwheel'], 1024),
        (std(None, 'Int64'), ['lwheel.data', 'rwheel'], 1024),
        (std(None, 'Float64'), ['/lwheel', '/rwheel'], 1024),
        (arrays, ['/encoders[0]', '/encoders[1]'], 1000),
        (lambda: arrays('std_msgs/msg/Int16MultiArray', np.int16), ['/encoders[0]', '/encoders.data[1]'], 1000),
        (lambda: arrays(is_ros2=True), ['/encoders[0]', '/encoders[1]'], 1000),
        (turtlebot3, ['/sensor_state.left_encoder', '/sensor_state.right_encoder'], 4096),
        (duckietown, ['/duck/left_wheel_encoder_node/tick', '/duck/right_wheel_encoder_node/tick'], 135),
        (create3, ['/wheel_ticks.ticks_left', '/wheel_ticks.ticks_right'], 508.8),
    ],
)
def test_ticks_give_the_counts_of_a_coarser_encoder(tmp_path, make, sides, recorded_ppr):
    found = reencoded(tmp_path, make(), ['--ticks', *sides, *TICKS, recorded_ppr])
    differences = np.subtract(found, [sample[1:3] for sample in samples_of(angles_rad(COUNT), 64)])
    if recorded_ppr % 64 == 0:
        assert not differences.any()
    # Elsewhere a quarter of 64 / recorded of the counts may be one off.
    assert np.abs(differences).max() <= 1
    assert np.count_nonzero(differences) <= 2.0 * 0.25 * 64 / recorded_ppr * differences.size


@pytest.mark.parametrize('make', [jackal, lambda: jackal(True)], ids=['ROS 1', 'ROS 2'])
def test_travel_gives_the_counts_of_any_encoder(tmp_path, make):
    sides = ['/feedback.drivers[0].measured_travel', '/feedback.drivers[1].measured_travel']
    found = reencoded(tmp_path, make(), ['--ticks', *sides, '--unit', 'rad'], ppr=1000)
    assert np.array_equal(found, [sample[1:3] for sample in samples_of(angles_rad(COUNT), 1000)])


@pytest.mark.parametrize('is_ros2', [False, True])
def test_a_counter_of_16_bits_is_unwrapped(tmp_path, is_ros2):
    sides = ['/mobile_base/sensors/core.left_encoder', '/mobile_base/sensors/core.right_encoder']
    bag = kobuki(is_ros2)
    shown = [message.left_encoder for _, _, message in bag.rows]
    assert min(shown) < 1000 and max(shown) > 64_000  # it wraps on the way
    found = np.array(reencoded(tmp_path, bag, ['--ticks', *sides, '--robot', 'kobuki'], ppr=90))
    travelled = np.floor(np.outer(np.arange(251) * 0.02, (4.0, 4.4)) * 90 / (2.0 * np.pi))
    assert found.shape == travelled.shape  # Kobuki reports at 50 Hz
    assert np.abs(found - found[0] - travelled).max() <= 1


def test_a_modulus_that_is_given_goes_before_the_width_of_the_field(tmp_path):
    bag = Bag()
    for stamp_ns, left, right in instants():
        for topic, angle in (('/lwheel', left), ('/rwheel', right)):
            bag.add(topic, stamp_ns, 'std_msgs/msg/Int32', data=int(ticks(angle, 1024)) % 1000)
    sides = ['--ticks', '/lwheel', '/rwheel', *TICKS, 1024, '--ticks-modulus', 1000]
    assert reencoded(tmp_path, bag, sides) == [list(sample[1:3]) for sample in samples_of(angles_rad(COUNT), 64)]


@pytest.mark.parametrize('late_ns', [4_000_000, 9_999_999])
def test_wheels_of_two_topics_are_those_of_the_same_instant(tmp_path, late_ns):
    found = reencoded(tmp_path, two_topics(1024, late_ns=late_ns), ['--ticks', '/lwheel', '/rwheel', *TICKS, 1024])
    expected = [list(sample[1:3]) for sample in samples_of(angles_rad(COUNT), 64)]
    # The last left one has no right one after it; an interpolated count may be one of 1024 off.
    differences = np.subtract(found, expected[len(expected) - len(found) :])
    assert len(found) >= 99 and np.count_nonzero(differences) <= 0.1 * differences.size
    assert np.abs(differences).max() <= 1


def test_stamps_are_those_of_the_headers_or_of_receipt(tmp_path, capsys):
    """Topics without a header, and one whose header is never set, are stamped by the recorder; it is said once."""
    late = turtlebot3()
    late.rows = [(topic, time_ns + 3 * TICK_NS, message) for topic, time_ns, message in late.rows]
    sides = ['--ticks', '/sensor_state.left_encoder', '/sensor_state.right_encoder', *TICKS, 4096]
    expected = reencoded(tmp_path, late, sides)
    assert 'no stamps' not in capsys.readouterr().err
    assert expected == [list(sample[1:3]) for sample in samples_of(angles_rad(COUNT), 64)]
    unset = turtlebot3()
    for _, _, message in unset.rows:
        message.header.stamp.sec = message.header.stamp.nanosec = 0
    (tmp_path / 'unset').mkdir()
    assert reencoded(tmp_path / 'unset', unset, sides) == expected
    error = capsys.readouterr().err
    assert error.count('no stamps') == 1 and '/sensor_state every 10.0 ms +- 0.0 ms' in error
