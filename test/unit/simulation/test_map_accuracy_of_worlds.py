"""The maps beside the worlds were made by SLAM (scripts/remake_maps.sh); they must be true to them."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import IDENTITY, move_along_arc
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.simulation.rasterise import map_accuracy, true_surface, visible_points
from diff_encoder_sim.simulation.world import load_world
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from places import ROOT

SCAN_HEIGHT_M, RANGE_M, NEAR_M = 1.12, 5.9, 0.05
BEARINGS_RAD = np.linspace(-math.pi, math.pi, 720, endpoint=False)


def tour(name):
    """Where the robot came by, each half second."""
    test = load_params(TestDefinition, ROOT / 'config' / 'mapping' / f'{name}.yaml')
    drive, poses = ScriptedDrive(test), [test.start.pose()]
    for step in range(int(2.0 * drive.duration_s)):
        linear, angular = drive.command(0.5 * step, 0.5 * (step + 1))
        poses.append(move_along_arc(poses[-1], 0.5 * linear, 0.5 * angular))
    return poses


@pytest.mark.parametrize('name', ['hallway', 'ros_logo'])
def test_it_is_true_to_its_world(name):
    world, poses = load_world(ROOT / 'worlds' / f'{name}.world'), tour(name)
    surface = true_surface(world, SCAN_HEIGHT_M, poses[0].x_m, poses[0].y_m)
    visible = visible_points(world, SCAN_HEIGHT_M, surface, poses[::2], BEARINGS_RAD, RANGE_M)
    accuracy = map_accuracy(load_map(ROOT / 'worlds' / f'{name}.yaml'), IDENTITY, surface, visible, NEAR_M)
    assert accuracy.correct_fraction >= 0.99
    assert accuracy.mapped_fraction >= 0.97
