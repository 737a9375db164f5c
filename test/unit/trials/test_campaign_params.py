"""What a campaign varies: the product of parameters, and named sets of them."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.campaign_cells import CampaignParams

RATE, MISSED = 'config.rate', 'config.encoder.faults.missed'


def params(**changes):
    return CampaignParams.from_mapping({'name': 'a', 'tests': ['SL'], 'ppr': [40], **changes}, '')


def test_without_varied_parameters_there_is_one_combination():
    one = params(set={RATE: 10.0})
    assert (one.varied_keys, list(one.combinations()), one.combination_count()) == ([], [()], 1)
    assert one.values_of(()) == {RATE: 10.0}


def test_variants_are_named_and_not_multiplied_by_each_other():
    three = params(variants={'none': {}, 'missed': {MISSED: 0.01}, 'slow': {RATE: 5.0}}, set={RATE: 10.0})
    assert three.varied_keys == ['variant'] and three.combination_count() == 3
    combinations = list(three.combinations())
    assert combinations == [(('variant', name),) for name in ('none', 'missed', 'slow')]
    assert [three.values_of(varied) for varied in combinations] == [
        {RATE: 10.0},
        {RATE: 10.0, MISSED: 0.01},
        {RATE: 5.0},
    ]


def test_variants_are_multiplied_by_what_else_is_varied():
    four = params(variants={'none': {}, 'missed': {MISSED: 0.01}}, vary={'simulator.lidar.noise': [0.01, 0.03]})
    assert four.varied_keys == ['simulator.lidar.noise', 'variant'] and four.combination_count() == 4
    last = list(four.combinations())[-1]
    assert last == (('simulator.lidar.noise', 0.03), ('variant', 'missed'))
    assert four.values_of(last) == {'simulator.lidar.noise': 0.03, MISSED: 0.01}


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'variants': {'a\nb': {}}}, 'variants'),
        ({'variants': {'': {}}}, 'variants'),
        ({'variants': {'none': 1}}, 'variants.none: given 1; allowed: a mapping'),
        ({'variants': [1]}, 'variants: given'),
        ({'encoders': 'amt102'}, "encoders: given 'amt102'"),
    ],
)
def test_a_mistake_is_named(changes, message):
    with pytest.raises(ConfigError, match=message):
        params(**changes)
