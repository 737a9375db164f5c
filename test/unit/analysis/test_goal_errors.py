"""The final pose minus the goal."""

import math

import pytest

from diff_encoder_sim.analysis.bag_dataset import goal_errors
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_recording import read_trial
from trial_bags import ROOT, write_bag


def test_errors_are_along_the_maps_axes_and_odometry_counts_from_the_start(tmp_path):
    test = load_test('SL', ROOT / 'config').model_dump()
    test['start'] = {'x': 5.0, 'y': 2.0, 'yaw': math.pi / 2}
    test['route'] = [{'goal': {'x': 4.0, 'y': 5.0, 'yaw': math.pi}}]
    about = Trial.from_mapping({'test': test, 'nav': 'embedded'}, '')
    path = write_bag(
        tmp_path / 'a.bag', about, [(0, 0, 0), (3.0, 0.8, 1.6)], [(5.0, 2.0, math.pi / 2), (4.1, 5.3, -3.0)]
    )
    errors = goal_errors(read_trial(path))
    assert errors[PoseSource.AMCL] is None and errors[PoseSource.GLOBAL] is None
    assert errors[PoseSource.ODOM] == pytest.approx([0.2, 0.0, 1.6 - math.pi / 2])
    assert errors[PoseSource.WORLD] == pytest.approx([0.1, 0.3, math.pi - 3.0])
