"""Maps of particles: which rays are entered and where, patches shared and copied on write, and how maps grow."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.patches import HITS, MEAN_X, MEAN_Y, VISITS
from slam_room import CELL_M, cells_of, maps_of, patch_counts, rays_of


def entered(pose, *rays):
    """The cells (height, width, 4) of a map with its corner at (-4, -4)."""
    maps = maps_of(1)
    for each in rays:
        maps.update(np.array([pose]), each)
    return cells_of(maps, 0)


def test_a_ray_passes_cells_and_ends_in_one():
    cells = entered((0.01, 0.02, 0.0), rays_of([1.0]))
    assert np.argwhere(cells[..., VISITS]).tolist() == [[80, column] for column in range(80, 101)]
    assert np.argwhere(cells[..., HITS]).tolist() == [[80, 100]]
    assert cells[80, 100, [MEAN_X, MEAN_Y]] == pytest.approx([0.2, 0.4], abs=1e-5)


def test_a_slanting_ray_crosses_every_cell_on_its_way():
    rng, along = np.random.default_rng(2), np.linspace(0.0, 2.3, 50_001)
    for _ in range(20):
        x, y, yaw = rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(-4, 4)
        rows = np.floor((y + along * math.sin(yaw) + 4.0) / CELL_M).astype(int)
        columns = np.floor((x + along * math.cos(yaw) + 4.0) / CELL_M).astype(int)
        crossed = entered((x, y, yaw), rays_of([2.3]))[..., VISITS] > 0
        # A corner may be cut by less than the points are apart.
        assert crossed[rows, columns].all()
        assert crossed.sum() <= len(set(zip(rows.tolist(), columns.tolist()))) + 1


def test_cells_remember_the_mean_of_their_hits():
    cell = entered((0.0, 0.01, 0.0), *(rays_of([range_m]) for range_m in (1.001, 1.021, 1.044)))[80, 100]
    assert cell[[HITS, VISITS]].tolist() == [3, 3]
    assert cell[MEAN_X] * CELL_M == pytest.approx((0.001 + 0.021 + 0.044) / 3, abs=1e-6)


def test_the_laser_is_where_it_is_mounted():
    """Base at (1, -1) heading west: the laser at (0.7, -1.1), looking south."""
    rays = rays_of([1.0], laser=Pose2D(0.3, 0.1, 0.5 * math.pi))
    hit = np.argwhere(entered((1.0, -1.0, math.pi), rays)[..., HITS])[0]
    assert ((hit + 0.5) * CELL_M - 4.0).tolist() == pytest.approx([-2.1, 0.7], abs=0.026)


@pytest.mark.parametrize(
    ('given', 'changes', 'used'),
    [
        (2.0, {}, [(2.0, True)]),
        (5.995, {}, []),  # beyond range_max less 1 cm
        (math.inf, {}, []),
        (math.inf, {'maxRange': 6.0, 'maxUrange': 5.0}, [(5.0, False)]),  # nothing up to range_max
        (math.inf, {'maxRange': 6.0}, [(6.0, False)]),
        (4.0, {'maxUrange': 3.0}, [(3.0, False)]),
        (math.nan, {}, []),
        (-math.inf, {}, []),
        (0.05, {}, []),
    ],
)
def test_how_a_range_is_used(given, changes, used):
    rays = rays_of([given], **changes)
    assert list(zip(rays.lengths_m, rays.is_hit)) == used


def test_references_are_those_of_the_tables():
    rng, maps, rays = np.random.default_rng(3), maps_of(6), rays_of([1.0, 2.0, 0.5, 1.5])
    for step in range(12):
        poses = np.column_stack([rng.uniform(-1, 1, (6, 2)), rng.uniform(-3, 3, 6)])
        before = [cells_of(maps, i).copy() for i in range(6)]
        maps.update(poses, rays)
        for index in range(6):  # only where the own rays went
            grown = cells_of(maps, index)[..., :2] - before[index][..., :2]
            assert (grown == entered(poses[index], rays)[..., :2]).all()
        counts = np.bincount(maps.table.ravel(), minlength=len(maps.references))
        assert (maps.references[1:] == counts[1:]).all()
        assert patch_counts(maps)[0] == np.count_nonzero(counts[1:])
        assert not maps.cells[0].any()
        if step % 3 == 2:
            maps.resample(np.sort(rng.integers(0, 6, 6)))


def test_maps_grow_where_they_must():
    maps = maps_of(2)
    maps.update(np.zeros((2, 3)), rays_of([1.0]))
    height, width = cells_of(maps, 1).shape[:2]
    maps.cover(np.array([-4.1, -1.0]), np.array([4.0, 1.0]))
    cells = cells_of(maps, 1)
    added = cells.shape[1] - width
    assert cells.shape[0] == height and added * CELL_M >= 10.0
    assert maps.corner_m == pytest.approx([-4.0 - added * CELL_M, -4.0])
    assert np.argwhere(cells[..., HITS]).tolist() == [[80, 100 + added]]
    with pytest.raises(InputFault, match='too large'):
        maps.cover(np.zeros(2), np.array([1e6, 1e6]))
    assert cells_of(maps, 1).shape == cells.shape
