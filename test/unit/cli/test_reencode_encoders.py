"""The encoders that reencode's command line names."""

import argparse

import pytest
import yaml

from diff_encoder_sim.api.wheel_options import PAPER_PPR, chosen_encoders, given_encoders, parameters_with, ppr_of_text
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.wheels.catalogue import encoder_names
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from places import CONFIG

GEARMOTOR = EncoderModel(lines=12, side='motor', gear_ratio=34.014)


def given(ppr=None, encoder=None, own=None):
    options = argparse.Namespace(ppr=ppr, encoder=encoder)
    return chosen_encoders(given_encoders(options), EncoderParams(encoder=own) if own else EncoderParams())


def labels(**options):
    return [encoder.label for encoder in given(**options)]


def test_ideal_encoders_come_first_in_their_order():
    assert labels(ppr=['4096', '{left: 40, right: 90.5}']) == ['4096', '40-90.5']
    assert labels(ppr=['90'], encoder=['xl430', 'amt102']) == ['90', '4096 xl430', '8192 amt102']
    assert labels(encoder=['amt102']) == ['8192 amt102']
    assert labels() == [f'{ppr}' for ppr in PAPER_PPR]


def test_the_catalogue_is_every_encoder_of_the_package():
    assert [encoder.name for encoder in given(encoder=['catalogue'])] == encoder_names(CONFIG)


def test_the_robots_own_encoder_is_taken_where_it_has_a_resolution():
    [own] = given(own=GEARMOTOR)
    assert own.label == '1632.67' and own.resolution.startswith('12 lines x 4 x gear 34.014 = 1632.672 counts')
    assert labels(own=GEARMOTOR, encoder=['amt102']) == ['8192 amt102']


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        ({'ppr': ['90', '90.0']}, '--ppr: given 90 twice; allowed: each once'),
        ({'encoder': ['catalogue', 'amt102']}, '--encoder: given 8192 amt102 twice; allowed: each once'),
        ({'encoder': ['amt10']}, "encoder: given 'amt10'; allowed: "),
        ({'ppr': ['90'], 'own': GEARMOTOR}, '--ppr: given 90 beside encoder: 12 lines x 4 x gear 34.014 = 1632.672'),
    ],
)
def test_a_mistake_is_one_line(options, message):
    with pytest.raises(ConfigError) as caught:
        given(**options)
    assert str(caught.value).startswith(message) and '\n' not in str(caught.value)


@pytest.mark.parametrize('text', ['0', 'many', '{left: 40', '[40]'])
def test_what_is_no_ppr_is_refused_by_its_option(text):
    with pytest.raises(ConfigError, match='^--pulses-ppr: ppr'):
        ppr_of_text('--pulses-ppr', text)


def test_a_real_encoder_replaces_the_robots_and_keeps_what_is_not_its_own(tmp_path):
    content = {'name': 'a', 'source': ['b'], 'price': 'hobby', 'encoder': {'sensor': 'absolute', 'bits': 10}}
    (tmp_path / 'mine.yaml').write_text(yaml.safe_dump({**content, 'config': {'counter_modulus': 1024}}))
    [real] = given(encoder=[str(tmp_path / 'mine.yaml')])
    robot = EncoderParams(left_joint='l', rate=50.0, seed=7, encoder=GEARMOTOR)
    params, odometry = parameters_with(real, robot, OdometryParams(wheel_diameter=0.1, encoder=GEARMOTOR))
    assert params.encoder == odometry.encoder == EncoderModel(sensor='absolute', bits=10)
    assert (params.left_joint, params.rate, params.seed, params.counter_modulus) == ('l', 50.0, 7, 1024)
    assert (odometry.counter_modulus, odometry.wheel_diameter) == (1024, 0.1)
    assert params.counts_per_turn == odometry.counts_per_turn == real.ppr
