"""Laser scans: LaserScan."""

from __future__ import annotations

import struct
from typing import Tuple

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.drives.field_reader import FieldReader
from diff_encoder_sim.drives.primitives import encode_array, encode_header, encode_numbers

# angle_min, angle_max, angle_increment, time_increment, scan_time, range_min, range_max.
_LIMITS = struct.Struct('<7f')
_FLOAT32 = np.dtype('<f4')


def encode_scan(scan: Scan, frame: str, period_s: float) -> bytes:
    """Encode sensor_msgs/LaserScan whose rays were all taken at its stamp, one scan each `period_s`."""
    angle_min_rad, increment_rad = scan.angle_min_rad, scan.angle_increment_rad
    angle_max_rad = angle_min_rad + (len(scan.ranges_m) - 1) * increment_rad
    limits = _LIMITS.pack(
        angle_min_rad, angle_max_rad, increment_rad, 0.0, period_s, scan.range_min_m, scan.range_max_m
    )
    ranges = encode_array(scan.ranges_m, _FLOAT32.str)
    return encode_header(scan.stamp_ns, frame) + limits + ranges + encode_numbers('f', ())


def decode_scan(raw: bytes, is_cdr: bool = False) -> Tuple[Scan, str]:
    """Decode a LaserScan into the scan and its frame, which some write with a leading slash.

    Raises:
        InputFault: the message is torn.
    """
    fields = FieldReader(raw, is_cdr)
    stamp_ns, frame = fields.header()
    angle_min_rad, _, increment_rad, _, _, range_min_m, range_max_m = fields.unpack(_LIMITS, _FLOAT32.itemsize)
    ranges = fields.content(fields.length() * _FLOAT32.itemsize)
    ranges_m = np.frombuffer(ranges, _FLOAT32).astype(float)
    return Scan(stamp_ns, angle_min_rad, increment_rad, range_min_m, range_max_m, ranges_m), frame.lstrip('/')
