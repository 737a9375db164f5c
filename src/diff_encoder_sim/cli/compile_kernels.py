"""Compiles all kernels ahead, for setup.sh; numba keeps the machine code."""

from __future__ import annotations

from diff_encoder_sim.lockstep.kernels_warm_up import warm_up
from diff_encoder_sim.slam.slam_params import GridSlamParams
from diff_encoder_sim.slam.slam_warm_up import warm_up as warm_up_slam


def main() -> None:
    """Compile what is not compiled yet."""
    warm_up()
    warm_up_slam(GridSlamParams())
