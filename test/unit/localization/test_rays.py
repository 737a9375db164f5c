"""Which rays the mapper uses, and as what."""

import math

import pytest

from slam_maps import rays_of


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
