"""How rays are sorted by where they end on the map, and the decision lost or found."""

import math

import numpy as np
import pytest

from amcl_world import ELSEWHERE, RESOLUTION_M, START, moved, pillar_room, simulated_scan
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.localization.scan_fit import FitMap, LostDetector, ScanFit

ROOM, DISTANCE_M = pillar_room(), 0.2
# Free from x = -2.5 m to a wall of one cell at 2 m, and unknown beyond it.
CELLS = np.full((100, 100), FREE, np.int8)
CELLS[:, 90], CELLS[:, 91:] = OCCUPIED, UNKNOWN
WALL_AHEAD = OccupancyGrid(CELLS, RESOLUTION_M, Pose2D(-2.5, -2.5, 0.0))


@pytest.mark.parametrize(
    ('laser_x_m', 'range_m', 'expected'),
    [
        (0.0, 2.025, (20, 0, 0)),  # on the wall
        (0.0, 1.85, (20, 0, 0)),  # 0.175 m before its centre
        (0.0, 2.20, (20, 0, 0)),
        (0.0, 1.75, (0, 0, 20)),  # short of it: a person
        (0.0, 2.30, (0, 20, 0)),  # through it, into what is unknown
        (0.0, 9e5, (0, 20, 0)),  # through it, off the map
        (0.0, math.inf, (0, 0, 0)),
        (0.0, math.nan, (0, 0, 0)),
        (0.0, 0.05, (0, 0, 0)),
        # From off the map, rays are followed onto it.
        (-5.0, 7.025, (20, 0, 0)),
        (-5.0, 6.0, (0, 0, 20)),
        (-5.0, 7.4, (0, 20, 0)),
        (-5.0, 1.0, (0, 0, 0)),  # not even to the map
        (-1e5, 1e5 + 2.4, (0, 20, 0)),
        (3.0, 9e5, (0, 0, 0)),
    ],
)
def test_rays_against_one_wall(laser_x_m, range_m, expected):
    scan = Scan(0, 0.0, 0.0, 0.1, 1e6, np.full(20, range_m))  # all straight ahead
    assert FitMap(WALL_AHEAD, DISTANCE_M).fit(Pose2D(laser_x_m, 0.0, 0.0), scan, IDENTITY) == ScanFit(*expected)


@pytest.mark.parametrize(
    ('fit', 'fraction'), [((30, 10, 40), 30 / (30 + 10 + 10)), ((0, 0, 100), 0.0), ((9, 0, 0), None), ((10, 0, 0), 1.0)]
)
def test_the_fraction_of_rays_that_fit(fit, fraction):
    assert ScanFit(*fit).fraction == fraction


def test_the_laser_may_be_anywhere_on_the_robot_and_the_map_anywhere_in_its_frame():
    mount, shift = Pose2D(0.2, -0.1, 0.7), Pose2D(10.0, -7.0, 1.1)
    scan = simulated_scan(ROOM, START, laser_pose_in_base=mount)
    there = ROOM._replace(origin=shift.compose(ROOM.origin))
    assert FitMap(there, DISTANCE_M).fit(shift.compose(START), scan, mount).fraction == 1.0
    assert FitMap(there, DISTANCE_M).fit(START, scan, mount).fraction != 1.0


def test_people_all_around_are_not_a_wrong_place():
    """Half of the view blocked still fits; a wrong place does not, though nothing blocks it."""
    scan, fit_map = simulated_scan(ROOM, START), FitMap(ROOM, DISTANCE_M)
    blocked = scan.ranges_m.copy()
    blocked[::2] = np.minimum(blocked[::2], 0.5)
    assert fit_map.fit(START, scan._replace(ranges_m=blocked), IDENTITY).fraction > 0.7
    for wrong in (ELSEWHERE, moved(START, 1.0, 0.0), moved(START, 0.0, math.radians(30))):
        assert fit_map.fit(wrong, scan, IDENTITY).fraction < 0.5


def test_the_decision_needs_scans_in_a_row():
    detector = LostDetector(AmclParams(lost_fraction=0.5, lost_scans=3), ROOM)
    good, bad = simulated_scan(ROOM, START), simulated_scan(ROOM, ELSEWHERE)
    none = good._replace(ranges_m=np.full(180, np.inf))
    seen = []
    for scan in (bad, bad, good, bad, none, bad, bad, good, good, bad, good, good, good):
        detector.check(START, scan, IDENTITY, may_be_found=True)
        seen.append(detector.is_lost)
    assert seen == [False] * 6 + [True] * 6 + [False]


def test_to_be_found_takes_a_larger_fraction_than_not_to_be_lost():
    detector = LostDetector(AmclParams(lost_fraction=0.5, lost_scans=1), ROOM)
    ranges = simulated_scan(ROOM, START).ranges_m.copy()
    ranges[:140] = 0.5
    so_so = simulated_scan(ROOM, START)._replace(ranges_m=ranges)
    detector.check(START, so_so, IDENTITY, may_be_found=True)
    assert 0.5 < detector.fit_fraction < 0.75 and not detector.is_lost
    detector.declare_lost()
    detector.check(START, so_so, IDENTITY, may_be_found=True)
    assert detector.is_lost
    detector.check(START, simulated_scan(ROOM, START), IDENTITY, may_be_found=False)
    assert detector.is_lost
    detector.check(START, simulated_scan(ROOM, START), IDENTITY, may_be_found=True)
    assert not detector.is_lost
