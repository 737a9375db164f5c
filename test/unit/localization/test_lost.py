"""Lost detection: how a scan's rays are sorted, the verdict over scans, and the filter meanwhile."""

import math
import subprocess
import sys

import numpy as np
import pytest

from amcl_world import RESOLUTION_M, moved, pillar_room, simulated_scan
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.lost import LostDetector
from diff_encoder_sim.localization.scan_fit import FitMap, ScanFit
from diff_encoder_sim.mapping.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from places import SOURCE, SUPPORT

ROOM = pillar_room()
START = Pose2D(0.9, -0.6, 1.8)
ELSEWHERE = Pose2D(-2.0, -0.2, -0.9)
DISTANCE_M = 0.2
ON = dict(
    lost_fraction=0.5,
    lost_scans=5,
    max_particles=1000,
    laser_max_beams=60,
    initial_pose_x=START.x_m,
    initial_pose_y=START.y_m,
    initial_pose_a=START.yaw_rad,
    initial_cov_xx=0.0025,
    initial_cov_yy=0.0025,
    initial_cov_aa=0.0025,
)


def wall_ahead(wall_x_m=2.0, behind=UNKNOWN, cells_x=100):
    """Free from x = -2.5 m to a wall of one cell at `wall_x_m`, and `behind` beyond it."""
    cells = np.full((100, cells_x), FREE, np.int8)
    column = round((wall_x_m + 2.5) / RESOLUTION_M)
    cells[:, column] = OCCUPIED
    cells[:, column + 1 :] = behind
    return OccupancyGrid(cells, RESOLUTION_M, Pose2D(-2.5, -2.5, 0.0))


def rays_ahead(range_m, count=20):
    """All within a tenth of a degree of straight ahead."""
    return Scan(0, 0.0, math.radians(0.1) / count, 0.1, 1e13, np.full(count, range_m))


@pytest.mark.parametrize(
    ('range_m', 'expected'),
    [
        (2.025, ScanFit(20, 0, 0)),  # on the wall
        (1.85, ScanFit(20, 0, 0)),  # 0.175 m before its centre
        (2.20, ScanFit(20, 0, 0)),
        (1.75, ScanFit(0, 0, 20)),  # short of it: a person
        (2.30, ScanFit(0, 20, 0)),  # through it, into what is unknown
        (4.00, ScanFit(0, 20, 0)),  # through it, off the map
        (1e12, ScanFit(0, 20, 0)),
        (math.inf, ScanFit(0, 0, 0)),
        (math.nan, ScanFit(0, 0, 0)),
        (0.05, ScanFit(0, 0, 0)),
    ],
)
def test_rays_against_one_wall(range_m, expected):
    assert FitMap(wall_ahead(), DISTANCE_M).fit(IDENTITY, rays_ahead(range_m), IDENTITY) == expected


@pytest.mark.parametrize(
    ('laser_x_m', 'range_m', 'expected'),
    [
        (-5.0, 7.025, ScanFit(20, 0, 0)),
        (-5.0, 6.0, ScanFit(0, 0, 20)),
        (-5.0, 7.4, ScanFit(0, 20, 0)),
        (-5.0, 1e12, ScanFit(0, 20, 0)),
        (-5.0, 1.0, ScanFit(0, 0, 0)),  # not even to the map
        (-1e5, 1e5 + 2.4, ScanFit(0, 20, 0)),
        (3.0, 1e12, ScanFit(0, 0, 0)),
    ],
)
def test_rays_from_off_the_map_are_followed_onto_it(laser_x_m, range_m, expected):
    here = Pose2D(laser_x_m, 0.0, 0.0)
    straight = rays_ahead(range_m)._replace(angle_increment_rad=0.0)
    assert FitMap(wall_ahead(), DISTANCE_M).fit(here, straight, IDENTITY) == expected


def test_rays_that_pass_the_map_by_do_not_count():
    for y_m, yaw_rad in ((-9.0, 0.0), (-9.0, 1.5), (9.0, math.pi), (2.6, math.pi / 4)):
        here = Pose2D(-9.0, y_m, yaw_rad)
        assert FitMap(wall_ahead(), DISTANCE_M).fit(here, rays_ahead(40.0), IDENTITY).fraction is None


def test_rays_that_end_where_the_map_says_nothing_do_not_count():
    grid = wall_ahead()
    grid.cells[:, 60:] = UNKNOWN  # the wall included
    for range_m in (1.0, 4.0):
        assert FitMap(grid, DISTANCE_M).fit(IDENTITY, rays_ahead(range_m), IDENTITY).fraction is None


def test_a_diagonal_wall_of_one_cell_lets_few_rays_through():
    cells = np.full((100, 100), FREE, np.int8)
    np.fill_diagonal(cells[:, ::-1], OCCUPIED)
    grid = OccupancyGrid(cells, RESOLUTION_M, IDENTITY)
    scan = Scan(0, 0.0, 0.5 * math.pi / 180, 0.1, 10.0, np.full(180, 4.5))
    fit = FitMap(grid, DISTANCE_M).fit(Pose2D(0.3, 0.3, 0.0), scan, IDENTITY)
    assert fit.through > 0.75 * 180 and fit.short < 0.15 * 180


def test_the_share():
    assert ScanFit(30, 10, 40).fraction == pytest.approx(30 / (30 + 10 + 10))
    assert ScanFit(0, 0, 100).fraction == 0.0
    assert ScanFit(9, 0, 0).fraction is None and ScanFit(10, 0, 0).fraction == 1.0


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


def test_the_verdict_needs_scans_in_a_row():
    detector = LostDetector(AmclParams(lost_fraction=0.5, lost_scans=3), ROOM)
    good, bad = simulated_scan(ROOM, START), simulated_scan(ROOM, ELSEWHERE)
    none = good._replace(ranges_m=np.full(180, np.inf))
    seen = []
    for scan in (bad, bad, good, bad, none, bad, bad, good, good, bad, good, good, good):
        detector.check(START, scan, IDENTITY, may_be_found=True)
        seen.append(detector.is_lost)
    assert seen == [False] * 6 + [True] * 6 + [False]


def test_to_be_found_takes_a_better_share_than_not_to_be_lost():
    detector = LostDetector(AmclParams(lost_fraction=0.5, lost_scans=1), ROOM)
    ranges = simulated_scan(ROOM, START).ranges_m.copy()
    ranges[:140] = 0.5
    so_so = simulated_scan(ROOM, START)._replace(ranges_m=ranges)
    detector.check(START, so_so, IDENTITY, may_be_found=True)
    assert 0.5 < detector.fit_fraction < 0.75 and not detector.is_lost
    detector.declare_lost()
    detector.check(START, so_so, IDENTITY, may_be_found=True)
    assert detector.is_lost and detector.least_fraction == 0.75
    detector.check(START, simulated_scan(ROOM, START), IDENTITY, may_be_found=False)
    assert detector.is_lost
    detector.check(START, simulated_scan(ROOM, START), IDENTITY, may_be_found=True)
    assert not detector.is_lost


# ---- the filter


def amcl(**changes):
    return Amcl(AmclParams(**{**ON, **changes}), ROOM, np.random.default_rng(0))


def feed(filter_, true_pose, count, odom_pose=IDENTITY):
    """Scans from where the robot stands; whether it is lost after each."""
    scan = simulated_scan(ROOM, true_pose)
    verdicts = []
    for _ in range(count):
        filter_.update(odom_pose, scan, IDENTITY)
        verdicts.append(filter_.is_lost)
    return verdicts


def test_carried_off_and_back():
    """Lost at the fifth scan; the particles stay, so that it is found when it is back."""
    filter_ = amcl()
    assert not any(feed(filter_, START, 5)) and filter_.fit_fraction == 1.0
    particles = filter_.particles
    assert feed(filter_, ELSEWHERE, 20) == [False] * 4 + [True] * 16
    assert filter_.particles is particles
    assert feed(filter_, START, 6) == [True] * 4 + [False] * 2


@pytest.mark.parametrize('degrees', range(0, 360, 30))
def test_begun_two_metres_off(degrees):
    """Whichever way, off the map or not: lost at the fifth scan, found by a better pose."""
    guess = Pose2D(
        START.x_m + 2.0 * math.cos(math.radians(degrees)),
        START.y_m + 2.0 * math.sin(math.radians(degrees)),
        START.yaw_rad,
    )
    filter_ = amcl(initial_pose_x=guess.x_m, initial_pose_y=guess.y_m)
    assert feed(filter_, START, 10) == [False] * 4 + [True] * 6
    filter_.set_pose(moved(START, 0.1, 0.05), 0.01 * np.eye(3))
    assert not feed(filter_, START, 10)[-1]
    assert np.subtract(filter_.odom_pose_in_map, START) == pytest.approx(0, abs=0.2)


def test_limits_that_the_parameters_replace_are_no_fault():
    """A scan without limits of its own, where laser_*_range say where they are."""
    filter_ = amcl(laser_min_range=0.1, laser_max_range=5.0)
    scan = simulated_scan(ROOM, START)._replace(range_min_m=-1.0, range_max_m=math.inf)
    assert filter_.update(IDENTITY, scan, IDENTITY) is not None
    assert filter_.fit_fraction == 1.0


def test_upstreams_default_is_never_lost():
    filter_ = amcl(lost_fraction=0.0)
    feed(filter_, START, 1)
    assert not any(feed(filter_, ELSEWHERE, 20)) and filter_.fit_fraction is None
    filter_.global_localization()
    assert not filter_.is_lost


def test_a_new_pose_is_settled_on_the_spot():
    """Lost, the robot stands still; scans from there pull the particles to where it is."""
    filter_ = amcl()
    feed(filter_, START, 1)
    feed(filter_, ELSEWHERE, 6)
    filter_.set_pose(
        Pose2D(ELSEWHERE.x_m + 0.3, ELSEWHERE.y_m - 0.2, ELSEWHERE.yaw_rad + 0.2), np.diag([0.16, 0.16, 0.07])
    )
    assert not feed(filter_, ELSEWHERE, 30)[-1]
    assert np.subtract(filter_.odom_pose_in_map, ELSEWHERE) == pytest.approx(0, abs=0.25)


def test_frozen_odometry_that_is_right_again():
    """What it missed comes as one long move, whose noise spreads the particles."""
    filter_ = amcl()
    feed(filter_, START, 1)
    true_pose = moved(START, 1.0, -1.0)
    assert feed(filter_, true_pose, 8)[-1]
    assert not feed(filter_, true_pose, 6, moved(IDENTITY, 1.0, -1.0))[-1]


def test_global_localization_is_not_settled_on_the_spot():
    """Standing still, the particles would agree on a place that only looks alike."""
    filter_ = amcl()
    feed(filter_, START, 3)
    filter_.global_localization()
    assert filter_.is_lost
    count = filter_.update_count
    assert all(feed(filter_, START, 20)) and filter_.update_count == count + 1


def test_a_bad_scan_is_a_fault_also_between_updates():
    filter_ = amcl()
    feed(filter_, START, 1)
    with pytest.raises(InputFault, match='none of 180 rays'):
        filter_.update(IDENTITY, simulated_scan(ROOM, START)._replace(ranges_m=np.full(180, np.inf)), IDENTITY)


def test_rays_that_all_point_one_way_are_refused():
    scan = simulated_scan(ROOM, START)._replace(angle_increment_rad=0.0)
    with pytest.raises(InputFault, match='180 rays in one direction'):
        amcl().update(IDENTITY, scan, IDENTITY)
    one = scan._replace(ranges_m=scan.ranges_m[:1])
    assert amcl().update(IDENTITY, one, IDENTITY) is not None


# ---- compiling ahead

NOTHING_IS_COMPILED_AFTER = """
import importlib, pkgutil, sys
import numpy as np
from diff_encoder_sim import localization
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.amcl_warm_up import warm_up
from amcl_world import pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import Pose2D

modules = [importlib.import_module(localization.__name__ + '.' + found.name)
           for found in pkgutil.iter_modules(localization.__path__)]

def signatures():
    return {(kernel.__module__, name): kernel.signatures for module in modules
            for name, kernel in vars(module).items() if hasattr(kernel, 'signatures')}

params = AmclParams(laser_model_type=sys.argv[1], do_beamskip=True, lost_fraction=0.5,
                    max_particles=500, resample_interval=1)
warm_up(params)
before = {key: list(found) for key, found in signatures().items()}
assert sum(map(len, before.values())) >= 6, before
room = pillar_room()
amcl = Amcl(params, room, np.random.default_rng(0))
for step in range(6):
    pose = Pose2D(0.3 * step - 1.0, 0.0, 0.1)
    amcl.update(pose, simulated_scan(room, pose), Pose2D(0.1, 0.0, 0.2))
after = signatures()
assert before == after, {key: (before[key], after[key]) for key in after if before[key] != after[key]}
"""


@pytest.mark.parametrize('model', ['likelihood_field', 'likelihood_field_prob', 'beam'])
def test_after_the_warm_up_nothing_is_left_to_compile(model):
    result = subprocess.run(
        [sys.executable, '-c', NOTHING_IS_COMPILED_AFTER, model],
        cwd=str(SOURCE),
        env={'PYTHONPATH': f'{SOURCE}:{SUPPORT}', 'PATH': ''},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr[-2000:]
