"""Equation (1), and pulses per revolution as users write them."""

import math

import pytest

from diff_encoder_sim.wheels.encoder_params import ppr_label, pulses_from_angle
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


@pytest.mark.parametrize(
    ('angle_in_pulses', 'pulses'),
    [(0.0, 0), (0.99, 0), (1.01, 1), (-0.1, -1), (-1.0 - 1e-9, -2), (89.5, 89), (-90.5, -91)],
)
@pytest.mark.parametrize('ppr', [40, 90, 1024, 4096])
def test_equation_1_floors_at_positive_and_negative_angles(angle_in_pulses, pulses, ppr):
    assert pulses_from_angle(2 * math.pi * angle_in_pulses / ppr, ppr) == pulses


@pytest.mark.parametrize(('ppr', 'label'), [(90, '90'), ({'left': 40, 'right': 4096}, '40-4096'), (102.4, '102.4')])
def test_ppr_label(ppr, label):
    assert ppr_label(EncoderParams.from_mapping({'ppr': ppr}, '').ppr) == label
