"""Random generators of a trial: one independent stream per purpose, all from the trial's seed.

The encoder's resolution is not part of the seed, so equal trial numbers sample equal wheel phases
and noise at every PPR and can be compared in pairs.
"""

from __future__ import annotations

import zlib

import numpy as np


def generator(seed: int, stream: str) -> np.random.Generator:
    """Return the generator of one purpose; adding a stream does not change the others."""
    # crc32, because Python's string hash differs between processes.
    return np.random.default_rng([seed, zlib.crc32(stream.encode('utf-8'))])
