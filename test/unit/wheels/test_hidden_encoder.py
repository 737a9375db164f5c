"""The line about a motion noise that hides the encoder."""

import math

import pytest

from diff_encoder_sim.wheels.diagnostics import encoder_lateral_std, hidden_encoder, noise_lateral_std
from diff_encoder_sim.wheels.odometry_params import OdometryParams


def test_a_coarse_encoder_is_not_hidden():
    assert hidden_encoder(OdometryParams(ppr=40)) == ''


def test_both_are_the_closed_forms():
    m_per_pulse = math.pi * 0.2 / 90
    assert encoder_lateral_std(OdometryParams(ppr=90)) == pytest.approx(20 * m_per_pulse / 0.4 / math.sqrt(6), rel=1e-4)
    assert noise_lateral_std(2.7e-8, 0.4) == pytest.approx(0.03, rel=1e-3)
