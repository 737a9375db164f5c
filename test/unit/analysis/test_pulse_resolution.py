"""Table 3 worked out by hand."""

import math

import pytest

from diff_encoder_sim.analysis.tables import pulse_resolution, pulse_resolution_table
from table_records import records


def test_table_3_of_alto():
    rows = records(pulse_resolution_table([40.0, 90.0, 1024.0, 4096.0], 0.2, 0.4))
    assert [round(float(row['linear_mm']), 2) for row in rows] == [15.71, 6.98, 0.61, 0.15]
    assert [float(row['two_wheel_angle_deg']) for row in rows] == pytest.approx([4.5, 2.0, 0.17578125, 0.0439453125])
    assert [float(row['one_wheel_angle_deg']) for row in rows] == pytest.approx([2.25, 1.0, 0.087890625, 0.02197265625])


def test_table_3_by_hand():
    one = pulse_resolution(90, 0.2, 0.4)
    assert one.linear_m == pytest.approx(0.00698, abs=5e-6)  # not the 7.98 mm of the print
    assert math.degrees(one.two_wheel_angle_rad) == pytest.approx(2.0)
    assert math.degrees(one.one_wheel_angle_rad) == pytest.approx(1.0)
