"""Which trials of a dataset the paper's numbers are about: those of its tests, driven by its robot."""

from __future__ import annotations

import math
from typing import Any, Dict, Optional, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import Dataset, RobotGeometry
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial

# ALTO, by section 3 of the paper: its wheels, and its length and width [m].
WHEELS = RobotGeometry(0.2, 0.4)
OUTLINE_M = (0.5, 0.6)

# Numbers that differ less are the same robot, with calibrated wheels.
RELATIVE = 0.01


def of_paper(dataset: Dataset) -> Dataset:
    """Return the dataset with the trials alone that the paper's numbers are about.

    A robot is the paper's by its wheels, and by its outline where a campaign tells it; a test by all of its definition
    and by being navigated.
    """
    is_alto = _are_close(dataset.robot, WHEELS) and _are_close(_outline_m(dataset.manifest or {}), OUTLINE_M)
    tests = {test for test, requested in dataset.requested.items() if is_alto and _is_of_paper(requested)}
    return dataset._replace(trials=[trial for trial in dataset.trials if trial.test in tests])


def _is_of_paper(requested: Trial) -> bool:
    try:
        return requested.nav != 'scripted' and requested.test == load_test(
            requested.test.name, package_folder() / 'config'
        )
    except ConfigError:  # a test that the package does not have
        return False


def _outline_m(manifest: Dict[str, Any]) -> Optional[Tuple[float, float]]:
    """Return length and width of the footprint that a campaign's robot was navigated with; None where it tells none."""
    try:
        corners = manifest['configuration']['parameters'][0]['navigator']['local_costmap']['footprint']
        length_m, width_m = np.ptp(np.asarray(corners, float), axis=0)
    except (KeyError, IndexError, TypeError, ValueError):
        return None
    return float(length_m), float(width_m)


def _are_close(given: Optional[Tuple[float, float]], expected: Tuple[float, float]) -> bool:
    return given is None or all(math.isclose(*pair, rel_tol=RELATIVE) for pair in zip(given, expected))
