"""Which rays the mapper uses, and how they are entered into maps."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.map_update import update_maps
from diff_encoder_sim.localization.patches import HITS, MEAN_X, MEAN_Y, VISITS
from slam_maps import CELL_M, cells_of, maps_of, rays_of


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


def test_the_laser_is_where_it_is_mounted():
    maps = maps_of(1)
    rays = rays_of([1.0], laser=Pose2D(0.3, 0.1, 0.5 * math.pi))
    update_maps(maps, np.array([[1.0, -1.0, math.pi]]), rays)
    hit = np.argwhere(cells_of(maps, 0)[..., HITS])[0]
    # Base at (1, -1) heading west: the laser at (0.7, -1.1), looking south.
    assert ((hit + 0.5) * CELL_M - 4.0).tolist() == pytest.approx([-2.1, 0.7], abs=0.026)


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
def test_how_a_range_is_used(given, changes, hit, length_m):
    rays = rays_of([given], **changes)
    if hit is None:
        assert len(rays.lengths_m) == 0
    else:
        assert rays.lengths_m.tolist() == [length_m] and rays.is_hit.tolist() == [hit]
