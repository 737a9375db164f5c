"""The exact odometry of the suite: closed forms, and its independence of this package's odometry."""

import ast
import math
import subprocess
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


WITHOUT_OTHERS = """
import importlib.util, sys

class Refusing:
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[0] == 'diff_encoder_sim':
            raise ImportError(name)

sys.meta_path.insert(0, Refusing())
spec = importlib.util.spec_from_file_location('reference', sys.argv[1])
reference = importlib.util.module_from_spec(spec)
spec.loader.exec_module(reference)
import numpy as np
print(reference.exact_path(np.array([[0.0, 0.0], [1.0, 1.0]]), 0.4)[-1].tolist())
"""


def test_it_works_if_nothing_else_of_this_package_can_be_imported():
    command = [sys.executable, '-c', WITHOUT_OTHERS, reference.__file__]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == '[1.0, 0.0, 0.0]\n'


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


STEPS = st.lists(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)), min_size=1, max_size=6)


@given(STEPS, st.floats(0.1, 1.0))
def test_a_path_is_that_of_a_fine_numerical_integration(steps_m, separation_m):
    """Of x' = v cos yaw and y' = v sin yaw at constant speeds of the wheels, by Simpson's rule."""
    position_m, yaw_rad = 0j, 0.0
    for left_m, right_m in steps_m:
        way_m, turn_rad = 0.5 * (left_m + right_m), (right_m - left_m) / separation_m
        directions = np.exp(1j * (yaw_rad + turn_rad * np.linspace(0.0, 1.0, 201)))
        weights = np.array([1.0, *[4.0, 2.0] * 99, 4.0, 1.0]) / 600.0
        position_m, yaw_rad = position_m + way_m * (weights @ directions), yaw_rad + turn_rad
    travels_m = np.vstack([np.zeros(2), np.cumsum(steps_m, axis=0)])
    expected = position_m.real, position_m.imag, yaw_rad
    assert reference.exact_path(travels_m, separation_m)[-1] == pytest.approx(expected, abs=1e-8)


POSES = st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(-7.0, 7.0)).map(np.array)


@given(POSES, POSES)
def test_a_relative_pose_is_that_of_the_frame(start, end):
    x_m, y_m, yaw_rad = reference.relative_pose(start, end)
    cosine, sine = math.cos(start[2]), math.sin(start[2])
    back = start[0] + cosine * x_m - sine * y_m, start[1] + sine * x_m + cosine * y_m, start[2] + yaw_rad
    assert max(reference.pose_errors(np.array(back), end)) < 1e-9 and -math.pi <= yaw_rad < math.pi


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
