"""Encoders that are compared: their labels, and what their counts follow from."""

import math

import pytest

from diff_encoder_sim.wheels.catalogue import ChosenEncoder, chosen, load_encoder, own_encoder, resolution_text
from diff_encoder_sim.wheels.encoder_params import EncoderModel, PerWheel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from places import CONFIG


@pytest.mark.parametrize(
    ('model', 'text'),
    [
        ({}, ''),
        ({'lines': 2048}, '2048 lines x 4 = 8192 counts per wheel revolution'),
        ({'lines': 1, 'decoding': 'x1'}, '1 line x 1 = 1 counts per wheel revolution'),
        (
            {'lines': 12, 'side': 'motor', 'gear_ratio': 34.014},
            '12 lines x 4 x gear 34.014 = 1632.672 counts per wheel revolution',
        ),
        ({'sensor': 'hall', 'pole_pairs': 15}, '15 pole pairs x 6 = 90 counts per wheel revolution'),
        ({'sensor': 'absolute', 'bits': 14}, '2^14 = 16384 counts per wheel revolution'),
    ],
)
def test_the_counts_follow_from_the_datasheet(model, text):
    assert resolution_text(EncoderModel(**model)) == text


def test_a_real_encoder_is_called_by_counts_and_file():
    real = chosen(load_encoder('amt102', CONFIG, CONFIG))
    assert (real.label, real.name, real.ppr) == ('8192 amt102', 'amt102', PerWheel(left=8192, right=8192))
    assert real.resolution == '2048 lines x 4 = 8192 counts per wheel revolution'
    assert real.counts_per_metre(0.2) == pytest.approx(8192 / (0.2 * math.pi))
    assert real.overrides['config.encoder.lines'] == 2048 and real.overrides['config.ppr'] == {
        'left': 8192,
        'right': 8192,
    }


def test_an_ideal_encoder_has_its_ppr_alone():
    ideal = ChosenEncoder(PerWheel(left=40, right=90))
    assert (ideal.label, ideal.name, ideal.resolution) == ('40-90', '', '')
    assert ideal.overrides == {'config.ppr': {'left': 40, 'right': 90}}


def test_the_robots_own_has_no_name():
    own = own_encoder(EncoderParams(ppr=90, encoder=EncoderModel(lines=500)))
    assert (own.label, own.name) == ('2000', '') and own.resolution.startswith('500 lines x 4')
    assert own_encoder(EncoderParams(ppr=90)).label == '90'
