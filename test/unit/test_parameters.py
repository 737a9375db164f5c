"""Every number among the parameters of the package has bounds, which an error reports; values in use can be loaded."""

import math
import typing
import xmlrpc.client

import pytest
import yaml

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import for_xml_rpc, from_xml_rpc
from params_classes import example, numbers_of, params_classes

CLASSES = params_classes()

# Numbers that others read: arguments of a xacro, and constants of messages.
WITHOUT_BOUNDS = {('RobotFileParams', 'arguments'), ('NodeMapping', 'input')}


def test_the_walk_finds_the_classes():
    names = {each.__name__ for each in CLASSES}
    assert {'EncoderParams', 'NavigatorParams', 'GridSlamParams', 'CampaignParams', 'RobotFileParams'} <= names
    assert len(names) == len(CLASSES) >= 30


@pytest.mark.parametrize('params_class', CLASSES, ids=lambda each: each.__name__)
def test_every_number_has_bounds(params_class):
    for key, bounds in numbers_of(params_class):
        if (params_class.__name__, key) not in WITHOUT_BOUNDS:
            assert math.isfinite(bounds.least) and math.isfinite(bounds.most), key


def is_single(annotation):
    """Not a list, nor a mapping."""
    return typing.get_origin(annotation) not in (list, dict)


@pytest.mark.parametrize('params_class', CLASSES, ids=lambda each: each.__name__)
def test_numbers_beyond_their_bounds_name_bounds_and_unit(params_class):
    single = {field.alias or name for name, field in params_class.model_fields.items() if is_single(field.annotation)}
    for key, bounds in numbers_of(params_class):
        if key not in single:
            continue
        for value in (bounds.most * 2 + 1, bounds.least - 1, math.nan):
            with pytest.raises(ConfigError) as error:
                params_class.from_mapping({**example(params_class), key: value}, 'f.yaml')
            assert str(error.value) == f'f.yaml: {key.rstrip("_")}: given {value!r}; allowed: {bounds}'


@pytest.mark.parametrize('params_class', CLASSES, ids=lambda params_class: params_class.__name__)
def test_the_values_in_use_are_accepted_as_given_ones(params_class):
    """As nodes write them to the parameter server, and users store and load them."""
    values = params_class.from_mapping(example(params_class), 'test').values_in_use()
    ((stored,), _) = xmlrpc.client.loads(xmlrpc.client.dumps((for_xml_rpc(values),)))
    again = params_class.from_mapping(from_xml_rpc(yaml.safe_load(yaml.safe_dump(stored))), 'test')
    assert again.values_in_use() == values
