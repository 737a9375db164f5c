"""The files of config/ have every parameter that the code reads, with its default and unit."""

import re

import pytest
import yaml

from diff_encoder_sim.base.params import Params, flat
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.trials.robot_params import CONFIG_FILES
from diff_encoder_sim.wheels.encoder_params import PerWheel
from places import CONFIG

FILES = {**{stem: tuple(classes.values()) for stem, classes in CONFIG_FILES.items()}, 'slam': (GridSlamParams,)}

# An older spelling; the size of a rolling window, which the global costmap is not; move_base's key of the same name.
ELSEWHERE = {
    'amcl.beam_skip_error_threshold_',
    'navigation.global_costmap.width',
    'navigation.global_costmap.height',
    'navigation.global_costmap.resolution',
    'navigation.DWAPlannerROS.latch_xy_goal_tolerance',
}


def parameters(params_class, instance=None, prefix=''):
    """(dotted key, default, description) of each parameter that has an effect."""
    for name, field in params_class.model_fields.items():
        default = field.get_default(call_default_factory=True) if instance is None else getattr(instance, name)
        key = f'{prefix}{field.alias or name}'
        if isinstance(default, Params) and not isinstance(default, PerWheel):
            yield from parameters(type(default), default, f'{key}.')
        elif not (field.description or '').startswith('accepted'):
            yield key, default, field.description or ''


def lines_of(stem):
    """Dotted keys of a file with their lines, those that are commented out included."""
    path, found = [], {}
    for line in (CONFIG / f'{stem}.yaml').read_text().splitlines():
        match = re.match(r'( *)(?:# )?(\w+):(?: |$)', line)
        if match:
            path = [*path[: len(match[1]) // 2], match[2]]
            found.setdefault('.'.join(path), line)
    return found


@pytest.mark.parametrize('stem', FILES)
def test_a_file_has_every_parameter(stem):
    lines = lines_of(stem)
    keys = {key for params_class in FILES[stem] for key, _, _ in parameters(params_class)}
    given = {re.sub(r'\.scan\..*', '.scan', key) for key in keys}
    assert {key for key in given if f'{stem}.{key}' not in ELSEWHERE} - set(lines) == set()


@pytest.mark.parametrize('stem', FILES)
def test_a_value_that_is_commented_out_is_the_default(stem):
    set_here = dict(flat(yaml.safe_load((CONFIG / f'{stem}.yaml').read_text())))
    lines = lines_of(stem)
    for params_class in FILES[stem]:
        for key, default, _ in parameters(params_class):
            if key in lines and lines[key].lstrip().startswith('#') and key not in set_here:
                assert yaml.safe_load(lines[key].lstrip('# ')) == {key.split('.')[-1]: default}, key


@pytest.mark.parametrize('stem', FILES)
def test_a_parameter_with_a_unit_has_it_in_the_file_too(stem):
    """There, or at the one before it of the same unit."""
    lines = lines_of(stem)
    keys = list(lines)
    for params_class in FILES[stem]:
        for key, _, description in parameters(params_class):
            unit = re.search(r'\[[^]]+\]$', description)
            if unit and key in lines:
                index = keys.index(key)
                near = ' '.join(lines[near] for near in keys[max(0, index - 3) : index + 1])
                assert unit[0] in near, f'{stem}.{key}: {unit[0]}'
