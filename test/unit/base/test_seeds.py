"""One independent random stream for each purpose."""

import numpy as np

from diff_encoder_sim.base.seeds import generator


def drawn(seed, stream):
    return generator(seed, stream).integers(2**32, size=4).tolist()


def test_equal_seeds_and_streams_draw_the_same_and_others_do_not():
    draws = [drawn(seed, stream) for seed in (1, 2) for stream in ('lidar', 'amcl')]
    assert draws == [drawn(seed, stream) for seed in (1, 2) for stream in ('lidar', 'amcl')]
    assert len({tuple(draw) for draw in draws}) == 4


def test_streams_are_the_same_in_every_release():
    assert drawn(1, 'lidar') == np.random.default_rng([1, 0x51FDFCD2]).integers(2**32, size=4).tolist()
