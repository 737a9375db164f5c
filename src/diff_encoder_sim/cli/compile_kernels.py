"""Compile all numba kernels ahead of time, for setup.sh; numba caches the machine code."""

from __future__ import annotations

import concurrent.futures

from diff_encoder_sim.calibration.likelihood import warm_up as warm_up_calibration
from diff_encoder_sim.localization.fusion import warm_up as warm_up_fusion
from diff_encoder_sim.localization.grid_slam import warm_up as warm_up_slam
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.trials.kernels_warm_up import PARTS


def main() -> None:
    """Compile missing kernels, with one process per part; parts share no kernel."""
    with concurrent.futures.ProcessPoolExecutor() as processes:
        compiling = [processes.submit(part) for part in PARTS]
        compiling.append(processes.submit(warm_up_slam, GridSlamParams()))
        compiling.append(processes.submit(warm_up_calibration))
        compiling.append(processes.submit(warm_up_fusion))
        for each in compiling:
            each.result()
