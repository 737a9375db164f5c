"""Maps of particles: patches shared and copied on write, and how they grow."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.map_update import update_maps, usable_rays
from diff_encoder_sim.localization.patches import HITS, Extent
from patch_memory import patch_count, unshared_patch_count
from slam_maps import CELL_M, cells_of, maps_of, rays_of
from slam_room import params, room_scan


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
