"""One independent random stream for each purpose."""

import numpy as np

from diff_encoder_sim.base.seeds import generator


def test_each_seed_and_stream_has_numbers_that_are_the_same_in_every_release():
    drawn = {tuple(generator(seed, stream).integers(2**32, size=4)) for seed in (1, 2) for stream in ('lidar', 'amcl')}
    assert len(drawn) == 4
    assert tuple(np.random.default_rng([1, 0x51FDFCD2]).integers(2**32, size=4)) in drawn
