"""How much memory the particles' maps take, for tests and benchmark of SLAM."""

import numpy as np

from diff_encoder_sim.localization.patches import PatchMaps


def patch_count(maps: PatchMaps) -> int:
    """Patches in use, each counted once however many particles share it."""
    return len(maps.references) - 1 - int(maps.free_count[0])


def unshared_patch_count(maps: PatchMaps) -> int:
    """Patches that there would be if every particle had its own grid of what it has seen."""
    return int(np.count_nonzero(maps.table))


def memory_bytes(maps: PatchMaps) -> int:
    """Memory of the patches in use and of the tables."""
    return patch_count(maps) * maps.cells[0].nbytes + maps.table.nbytes
