"""Whatever value a parameter is given, it is taken and usable, or one line says what is allowed.

For every field of every class of parameters of the package, which are found by walking it.
"""

import math
import typing
import xmlrpc.client

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.text_values import for_xml_rpc, from_xml_rpc
from params_classes import example, numbers_of, params_classes

CLASSES = params_classes()

ABSURD = [
    1e300,
    -1e300,
    1e-300,
    -1e-300,
    10**400,
    -(10**400),
    2**63,
    2**64,
    -1,
    0,
    0.0,
    math.nan,
    math.inf,
    -math.inf,
    True,
    None,
    '',
    'x' * 100_000,
    '1e-3',
    '1e300',
    '\0',
    '\ud800\n',
    '[' * 100_000,
    'a/' * 2500,
    b'bytes',
    [],
    [[]],
    [1e300] * 3,
    [math.nan, 10**400, 'x'],
    [[1e300, 10**400]] * 4,
    {},
    {'x': 10**400},
    {'left': 1e300, 'right': 10**400},
    {1: 2},
    {'a', 'b'},
    object(),
]

# Numbers that are text to what they are handed to: arguments of a xacro.
WITHOUT_BOUNDS = {('RobotFileParams', 'arguments')}


def attempt(params_class, mapping):
    """The object, or None where one readable line refuses the mapping."""
    try:
        params = params_class.from_mapping(mapping, 'f.yaml')
    except ConfigError as error:
        line = str(error)
        assert line.startswith('f.yaml: ')
        assert line.isprintable()
        assert len(line) < 3100
        assert 'Error:' not in line
        return None
    assert params.model_dump() is not None  # it is whole
    return params


def test_the_walk_finds_the_classes():
    names = {each.__name__ for each in CLASSES}
    assert {'EncoderParams', 'NavigatorParams', 'GridSlamParams', 'CampaignParams', 'RobotFileParams'} <= names
    assert len(names) == len(CLASSES) >= 30


@pytest.mark.parametrize('params_class', CLASSES, ids=lambda each: each.__name__)
def test_the_example_is_accepted(params_class):
    """Else what the next tests change would not be what is refused."""
    assert attempt(params_class, example(params_class)) is not None


@pytest.mark.parametrize('params_class', CLASSES, ids=lambda each: each.__name__)
def test_every_number_has_bounds(params_class):
    found = dict(numbers_of(params_class))
    missing = {key for key, bounds in found.items() if bounds is None}
    assert {(params_class.__name__, key) for key in missing} <= WITHOUT_BOUNDS
    for key, bounds in found.items():
        if key not in missing:
            assert math.isfinite(bounds.least), key
            assert math.isfinite(bounds.most), key


@pytest.mark.parametrize('params_class', CLASSES, ids=lambda each: each.__name__)
def test_absurd_values_are_taken_or_refused_in_one_line(params_class):
    good = example(params_class)
    for name, field in params_class.model_fields.items():
        key = field.alias or name
        for value in [*ABSURD, 10**5000]:
            attempt(params_class, {**good, key: value})
    for value in [*ABSURD, 10**5000]:
        attempt(params_class, value)


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


VALUES = st.recursive(
    st.sampled_from(ABSURD[:-1]) | st.floats() | st.integers() | st.text(max_size=5) | st.booleans() | st.none(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=300, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_any_structure_is_taken_or_refused_in_one_line(data):
    params_class = data.draw(st.sampled_from(CLASSES))
    keys = [field.alias or name for name, field in params_class.model_fields.items()]
    changes = data.draw(st.dictionaries(st.sampled_from([*keys, 'unknown']), VALUES, max_size=3))
    attempt(params_class, {**example(params_class), **changes})


@pytest.mark.parametrize('params_class', CLASSES, ids=lambda params_class: params_class.__name__)
def test_the_values_in_use_are_accepted_as_given_ones(params_class):
    """As nodes write them to the parameter server, and users store and load them."""
    values = params_class.from_mapping(example(params_class), 'test').values_in_use()
    ((stored,), _) = xmlrpc.client.loads(xmlrpc.client.dumps((for_xml_rpc(values),)))
    again = params_class.from_mapping(from_xml_rpc(yaml.safe_load(yaml.safe_dump(stored))), 'test')
    assert again.values_in_use() == values
