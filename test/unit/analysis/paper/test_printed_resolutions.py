"""Table 3 as printed and as computed."""

import math

import pytest

from diff_encoder_sim.analysis.paper.paper_cells import compare_resolutions


def test_table_3_agrees_with_the_print_but_for_its_error():
    for row in compare_resolutions([40, 90, 1024, 4096], 0.2, 0.4):
        assert row.computed.two_wheel_angle_rad == pytest.approx(row.printed.angle_rad, rel=0.025)
        is_erratum = abs(row.printed.linear_m / row.computed.linear_m - 1.0) > 0.025
        assert is_erratum == (row.printed.ppr == 90)


def test_table_3_of_another_robot():
    (row,) = compare_resolutions([500.5], 0.1, 0.25)
    assert row.printed is None
    assert row.computed.linear_m == pytest.approx(math.pi * 0.1 / 500.5)
