"""The exact odometry of the suite: closed forms, and its independence of this package's odometry."""

import ast
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.conformance import reference
from diff_encoder_sim.conformance.cases import plan
from diff_encoder_sim.conformance.mapping import Wheels
from odometry_subjects import COUNTS, mapping_of

ANGLES_RAD = st.floats(-1e5, 1e5)


def test_it_imports_numpy_and_the_standard_library_only():
    imported = set()
    for node in ast.walk(ast.parse(Path(reference.__file__).read_text())):
        imported |= {alias.name for alias in node.names} if isinstance(node, ast.Import) else set()
        imported |= {node.module} if isinstance(node, ast.ImportFrom) else set()
    assert {name.split('.')[0] for name in imported} - set(sys.builtin_module_names) == {
        '__future__',
        'numpy',
        'typing',
    }


@pytest.mark.parametrize(
    ('left_m', 'right_m', 'pose'),
    [
        (2.0, 2.0, (2.0, 0.0, 0.0)),
        (-0.2 * math.pi, 0.2 * math.pi, (0.0, 0.0, math.pi)),  # in place: half a turn
        (0.0, 0.2 * math.pi, (0.2, 0.2, 0.5 * math.pi)),  # about the left wheel
        (0.2 * math.pi, 0.4 * math.pi, (0.6, 0.6, 0.5 * math.pi)),  # a quarter of a circle
        (-0.4 * math.pi, -0.2 * math.pi, (-0.6, -0.6, 0.5 * math.pi)),  # reverse
        (0.4 * math.pi, 0.0, (0.0, -0.4, -math.pi)),  # about the right wheel
    ],
)
def test_an_arc_is_exact_in_any_number_of_steps(left_m, right_m, pose):
    for steps in (1, 7, 100):
        travels_m = np.outer(np.linspace(0.0, 1.0, steps + 1), (left_m, right_m)) + (3.0, 5.0)
        assert reference.exact_path(travels_m, 0.4)[-1] == pytest.approx(pose, abs=1e-12)


@given(ANGLES_RAD, st.sampled_from([40, 90, 1024, 2578.33]))
def test_counts_are_the_floor(angle_rad, ppr):
    (count,) = reference.counts_of_angles(np.array([angle_rad]), ppr)
    assert count == math.floor(angle_rad * (ppr / (2.0 * math.pi)))


@given(st.integers(-(2**40), 2**40), st.sampled_from([8, 16, 32]))
def test_wrapped_counts_are_those_of_a_signed_integer(count, bits):
    raw = (count % 2**bits).to_bytes(bits // 8, 'little')
    assert reference.wrapped(np.array([count]), 2**bits)[0] == int.from_bytes(raw, 'little', signed=True)
    assert reference.wrapped(np.array([count]), 0)[0] == count


def test_the_suite_has_thirty_motions_one_of_an_hour():
    motions = [case for case in plan(mapping_of(COUNTS), Wheels())[0].cases if case.is_motion]
    assert len({case.name for case in motions}) == len(motions) == 30
    assert max(case.times_s[-1] for case in motions) >= 3600.0
