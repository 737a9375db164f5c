"""Laser scans: rosbags reads them, would write the same bytes, and decodes the same."""

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.sensor_messages import decode_scan, encode_scan
from message_checks import check_header, read
from reencoding_drives import MAKERS


def test_scan(rng):
    scan = values.scan(rng)
    message = read(encode_scan(scan, 'laser', 0.1), 'sensor_msgs/msg/LaserScan')
    check_header(message.header, scan.stamp_ns, 'laser')
    assert np.array_equal(message.ranges, scan.ranges_m.astype(np.float32))
    assert message.angle_max == pytest.approx(scan.bearings_rad()[-1], abs=1e-6)
    assert (
        message.angle_min,
        message.angle_increment,
        message.time_increment,
        message.scan_time,
        message.range_min,
        message.range_max,
    ) == pytest.approx((scan.angle_min_rad, scan.angle_increment_rad, 0.0, 0.1, 0.15, 6.0))
    assert len(message.intensities) == 0


def test_a_scan_is_decoded_as_it_was_encoded(rng):
    scan = values.scan(rng)
    decoded, frame = decode_scan(encode_scan(scan, '/laser', 0.1))
    assert (decoded.stamp_ns, frame) == (scan.stamp_ns, 'laser')
    assert decoded[1:5] == tuple(float(np.float32(limit)) for limit in scan[1:5])
    assert np.array_equal(decoded.ranges_m, scan.ranges_m.astype(np.float32))
    assert decoded.ranges_m.dtype == float


@MAKERS
def test_scans_that_rosbags_encodes(maker):
    ranges = np.array([0.5, np.inf, np.nan], np.float32)
    message = maker.scan(7, ranges, 'front')
    decoded, frame = decode_scan(maker.raw(message), maker.is_ros2)
    assert (decoded.stamp_ns, frame) == (7, 'front')
    assert decoded[1:5] == (message.angle_min, message.angle_increment, message.range_min, message.range_max)
    assert np.array_equal(decoded.ranges_m, ranges, equal_nan=True)


@MAKERS
def test_a_torn_scan_is_a_fault_wherever_it_is_torn(maker):
    ranges = np.array([0.5, 0.25], np.float32)
    raw = maker.raw(maker.scan(7, ranges, 'front'))
    for size in range(raw.index(ranges.tobytes()) + 8):
        with pytest.raises(InputFault):
            decode_scan(raw[:size], maker.is_ros2)
