"""Maps of particles: rays entered cell by cell, patches shared and copied on write."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.slam.map_update import update_maps
from diff_encoder_sim.slam.occupancy import occupancy
from diff_encoder_sim.slam.patches import HITS, MEAN_X, MEAN_Y, SIDE, VISITS, Extent, PatchMaps
from diff_encoder_sim.slam.rays import usable_rays
from patch_memory import memory_bytes, patch_count, unshared_patch_count
from slam_room import params, room_scan

CELL_M = 0.05


def maps_of(count, extent=Extent(-4.0, -4.0, 4.0, 4.0)):
    return PatchMaps(extent, CELL_M, count)


def rays_of(ranges, **changes):
    ranges = np.atleast_1d(np.asarray(ranges, dtype=float))
    scan = Scan(0, 0.0, 0.5 * math.pi, 0.1, 6.0, ranges)
    return usable_rays(scan, changes.pop('laser', IDENTITY), params(**changes))


def cells_of(maps, particle):
    """(height, width, 4) of one particle's grid."""
    rows, columns = maps.table.shape[1:]
    return maps.cells[maps.table[particle]].transpose(0, 2, 1, 3, 4).reshape(rows * SIDE, columns * SIDE, 4)


def test_a_ray_passes_cells_and_ends_in_one():
    maps = maps_of(1)
    update_maps(maps, np.array([[0.01, 0.02, 0.0]]), rays_of([1.0]))
    cells = cells_of(maps, 0)
    row, first, last = 80, 80, 100  # of the map's corner at (-4, -4)
    assert np.argwhere(cells[..., VISITS]).tolist() == [[row, c] for c in range(first, last + 1)]
    assert np.argwhere(cells[..., HITS]).tolist() == [[row, last]]
    assert cells[row, last, [MEAN_X, MEAN_Y]] == pytest.approx([0.2, 0.4], abs=1e-5)


def test_a_slanting_ray_crosses_every_cell_on_its_way():
    """Against points marched along it, for all directions."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        x, y, yaw = rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(-4, 4)
        maps = maps_of(1)
        update_maps(maps, np.array([[x, y, yaw]]), rays_of([2.3]))
        along = np.linspace(0.0, 2.3, 50_001)
        rows = np.floor((y + along * math.sin(yaw) + 4.0) / CELL_M).astype(int)
        columns = np.floor((x + along * math.cos(yaw) + 4.0) / CELL_M).astype(int)
        crossed = cells_of(maps, 0)[..., VISITS] > 0
        # A corner may be cut by less than the points are apart.
        assert crossed[rows, columns].all()
        assert crossed.sum() <= len(set(zip(rows.tolist(), columns.tolist()))) + 1


def test_cells_remember_the_mean_of_their_hits():
    maps = maps_of(1)
    for range_m in (1.001, 1.021, 1.044):
        update_maps(maps, np.array([[0.0, 0.01, 0.0]]), rays_of([range_m]))
    cell = cells_of(maps, 0)[80, 100]
    assert cell[[HITS, VISITS]].tolist() == [3, 3]
    assert cell[MEAN_X] * CELL_M == pytest.approx((0.001 + 0.021 + 0.044) / 3, abs=1e-6)


@pytest.mark.parametrize(
    ('given', 'changes', 'hit', 'length_m'),
    [
        (2.0, {}, True, 2.0),
        (5.995, {}, None, None),  # beyond range_max less 1 cm
        (math.inf, {}, None, None),
        (math.inf, {'maxRange': 6.0, 'maxUrange': 5.0}, False, 5.0),  # nothing up to range_max
        (math.inf, {'maxRange': 6.0}, False, 6.0),
        (4.0, {'maxUrange': 3.0}, False, 3.0),
        (math.nan, {}, None, None),
        (-math.inf, {}, None, None),
        (0.05, {}, None, None),
    ],
)
def test_what_a_range_says(given, changes, hit, length_m):
    rays = rays_of([given], **changes)
    if hit is None:
        assert len(rays.lengths_m) == 0
    else:
        assert rays.lengths_m.tolist() == [length_m] and rays.is_hit.tolist() == [hit]


def test_the_laser_is_where_it_is_mounted():
    maps = maps_of(1)
    rays = rays_of([1.0], laser=Pose2D(0.3, 0.1, 0.5 * math.pi))
    update_maps(maps, np.array([[1.0, -1.0, math.pi]]), rays)
    hit = np.argwhere(cells_of(maps, 0)[..., HITS])[0]
    # Base at (1, -1) heading west: the laser at (0.7, -1.1), looking south.
    assert ((hit + 0.5) * CELL_M - 4.0).tolist() == pytest.approx([-2.1, 0.7], abs=0.026)


def test_particles_share_patches_until_one_writes():
    maps = maps_of(3)
    update_maps(maps, np.zeros((3, 3)), usable_rays(room_scan(IDENTITY), IDENTITY, params()))
    assert patch_count(maps) == unshared_patch_count(maps)
    maps.resample(np.array([1, 1, 1]))
    shared = patch_count(maps)
    assert unshared_patch_count(maps) == 3 * shared
    before = cells_of(maps, 1).copy()

    only_first = maps.table[:1]
    whole, maps.table = maps.table, only_first
    update_maps(maps, np.zeros((1, 3)), rays_of([1.0]))
    maps.table = whole
    assert patch_count(maps) == shared + 2  # of the two that the ray crosses
    assert cells_of(maps, 0)[80, 100, HITS] == before[80, 100, HITS] + 1
    assert (cells_of(maps, 1) == before).all() and (cells_of(maps, 2) == before).all()


def test_references_are_those_of_the_tables():
    rng = np.random.default_rng(3)
    maps = maps_of(6)
    for step in range(12):
        poses = np.column_stack([rng.uniform(-1, 1, (6, 2)), rng.uniform(-3, 3, 6)])
        expected = [cells_of(maps, i).copy() for i in range(6)]
        update_maps(maps, poses, rays_of([1.0, 2.0, 0.5, 1.5]))
        for index in range(6):  # only where the own rays went
            alone = maps_of(1)
            update_maps(alone, poses[index : index + 1], rays_of([1.0, 2.0, 0.5, 1.5]))
            grown = cells_of(maps, index)[..., :2] - expected[index][..., :2]
            assert (grown == cells_of(alone, 0)[..., :2]).all()
        counts = np.bincount(maps.table.ravel(), minlength=len(maps.references))
        assert (maps.references[1:] == counts[1:]).all()
        assert patch_count(maps) == np.count_nonzero(counts[1:])
        assert not maps.cells[0].any()
        if step % 3 == 2:
            maps.resample(np.sort(rng.integers(0, 6, 6)))


def test_capacity_doubles_and_keeps_what_is_there():
    maps = maps_of(2)
    update_maps(maps, np.zeros((2, 3)), rays_of([1.0, 2.0]))
    before = [cells_of(maps, i).copy() for i in range(2)]
    capacity, used = len(maps.references), patch_count(maps)
    maps.ensure_free(capacity)
    assert len(maps.references) == 2 * capacity and patch_count(maps) == used
    assert all((cells_of(maps, i) == before[i]).all() for i in range(2))


def test_maps_grow_where_they_must():
    maps = maps_of(2)
    update_maps(maps, np.zeros((2, 3)), rays_of([1.0]))
    height, width = cells_of(maps, 1).shape[:2]
    maps.cover(Extent(-4.1, -1.0, 4.0, 1.0))
    cells = cells_of(maps, 1)
    added = cells.shape[1] - width
    assert cells.shape[0] == height and added * CELL_M >= 10.0
    assert maps.origin_x_m == pytest.approx(-4.0 - added * CELL_M)
    assert np.argwhere(cells[..., HITS]).tolist() == [[80, 100 + added]]
    with pytest.raises(InputFault, match='too large'):
        maps.cover(Extent(0.0, 0.0, 1e6, 1e6))
    assert cells_of(maps, 1).shape == cells.shape


def test_memory_is_that_of_what_was_seen():
    maps = maps_of(30)
    table_bytes = 30 * 25 * 4
    assert memory_bytes(maps) == table_bytes
    update_maps(maps, np.zeros((30, 3)), rays_of([1.0]))
    assert memory_bytes(maps) == table_bytes + 30 * 2 * SIDE * SIDE * 16
    maps.resample(np.zeros(30, int))
    assert memory_bytes(maps) == table_bytes + 2 * SIDE * SIDE * 16


def test_occupancy_of_cells():
    visits = np.array([[0, 10, 10, 10, 0, 0, 0]], dtype=float)
    hits = np.array([[0, 2, 3, 10, 0, 0, 0]], dtype=float)
    assert occupancy(hits, visits, 0.25).tolist() == [[-1, 0, 100, 100, -1, -1, -1]]


def test_stray_hits_behind_a_wall_are_unknown():
    hits = np.array([[0, 50, 9, 0, 9]], dtype=float)
    visits = np.array([[60, 60, 9, 0, 9]], dtype=float)
    assert occupancy(hits, visits, 0.25).tolist() == [[0, 100, -1, -1, 100]]
