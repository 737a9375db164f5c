"""Encoders that are compared, and the shipped ones: labels, counts, files."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.per_wheel import PerWheel, WheelDiameter
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.trials.robot_params import check_key, load_robot_config, override
from diff_encoder_sim.wheels.catalogue import OF_DEVICE, encoder_names, load_encoder, load_encoders, resolution_text
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.counter import wrap_count
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from places import CONFIG, ROOT

NAMES = encoder_names(CONFIG)

# Counts per wheel revolution, as the manuals print them.
PUBLISHED = {
    'amt102': '8192',
    'as5047p': '16384',
    'as5600': '4096',
    'create2': '508.8',
    'duckiebot': '135',
    'e4t': '1440',
    'fit0186': '2797',
    'gobilda_5203': '537.7',
    'heds_5540': '2000',
    'hoverboard_hub': '90',
    'jga25_371': '1980',
    'kobuki': '2578.33',
    'pololu_25d': '1632.67',
    'posital_inh': '4096',
    'romi': '1437.09',
    'sen_speed': '40',
    'xl430': '4096',
    'yahboom_520': '2464',
}

IN_ROBOTS = {
    'burger': 'xl430',
    'create2': 'create2',
    'gearmotor_kit': 'pololu_25d',
    'hoverboard': 'hoverboard_hub',
    'kobuki': 'kobuki',
}

GOOD = {
    'manufacturer': 'My',
    'part': 'One',
    'type': 'kit',
    'source': '[its manual]',
    'price': 'hobby',
    'encoder': '{lines: 16}',
}


def shipped(name):
    return load_encoder(name, CONFIG, ROOT)


def own_file(folder, **keys):
    path = folder / 'mine.yaml'
    path.write_text(''.join(f'{key}: {value}\n' for key, value in {**GOOD, **keys}.items() if value is not None))
    return path


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_encoder_counts_ten_turns_of_the_wheel_as_its_manual_states(name):
    encoder = shipped(name)
    decimals = len(PUBLISHED[name].partition('.')[2])
    counts_per_turn = encoder.ppr.left
    assert f'{counts_per_turn:.{decimals}f}' == PUBLISHED[name]
    angles_rad = np.repeat(np.linspace(0.0, 20 * math.pi, 2001)[:, np.newaxis], 2, axis=1)
    found = Chain(encoder.params).run(Drive(10_000_000 * np.arange(2001), angles_rad))
    # The last report before the end of the drive.
    turned = found.stamps_ns[0, -1] / 2e9 * counts_per_turn
    # A reading at either end: its rounding, and the sensor's own errors.
    sd = math.sqrt(2 * (1 / 12 + encoder.params.encoder.pulse_variance(counts_per_turn)))
    counted = wrap_count(np.diff(found.counts[0], axis=0), encoder.params.counter_modulus).sum(axis=0)
    assert counted == pytest.approx([turned, turned], abs=4 * sd)


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_encoder_can_replace_any_other_of_a_robot(name):
    encoder, config = shipped(name), load_robot_config(CONFIG)
    for key in {*encoder.overrides} - {'config.ppr'}:
        check_key(key)
    hall = {'sensor': 'hall', 'pole_pairs': 15, 'sensor_error': 2.0}
    config['config'] = {**config['config'], 'encoder': hall}
    params = override(config, encoder.overrides)
    for each in (params.encoder, params.odometry):
        assert (each.encoder, each.counter_modulus) == (encoder.params.encoder, encoder.params.counter_modulus)


@pytest.mark.parametrize('robot', IN_ROBOTS)
def test_the_catalogue_says_what_the_robots_with_these_encoders_say(robot):
    file, encoder = load_robot_file(robot, ROOT, ROOT, {}), shipped(IN_ROBOTS[robot])
    assert encoder.ppr.left == pytest.approx(file.ppr, rel=1e-9)
    of_device = {f'config.{key}' for key in OF_DEVICE} & {*encoder.overrides}
    expected = {key: file.overrides[key] for key in of_device}
    assert {key: encoder.overrides[key] for key in of_device} == pytest.approx(expected)


def test_shipped_encoders_link_to_their_documentation_and_have_the_shaft_of_their_file():
    files = {name: shipped(name).real for name in NAMES}
    assert all(file.link for file in files.values())
    shafts = {name: files[name].shaft for name in ('pololu_25d', 'sen_speed', 'amt102')}
    assert shafts == {'pololu_25d': 'motor', 'sen_speed': 'wheel', 'amt102': 'any'}


def test_a_file_of_ones_own_is_relative_to_the_folder_a_name_comes_first_and_catalogue_is_all_of_them(tmp_path):
    own_file(tmp_path, config='{rate: 50.0, report: {latency: 0.02}}').rename(tmp_path / 'e4t.yaml')
    encoder = load_encoder('e4t.yaml', CONFIG, tmp_path)
    assert (encoder.real.name, encoder.real.source, encoder.real.price) == ('My One', ['its manual'], 'hobby')
    assert (encoder.params.rate, encoder.params.report.latency, encoder.label) == (50.0, 0.02, '64 e4t')
    found = load_encoders(['e4t', 'e4t.yaml', 'catalogue'], CONFIG, tmp_path)
    assert [each.name for each in found] == ['e4t', 'e4t', *NAMES] and found[0].ppr.left == 1440


@pytest.mark.parametrize('given', ['amt10', 'folder.yaml', 'mine.yml'])
def test_an_unknown_encoder_lists_the_known_ones(tmp_path, given):
    own_file(tmp_path).rename(tmp_path / 'mine.yml')
    (tmp_path / 'folder.yaml').mkdir()
    with pytest.raises(ConfigError) as caught:
        load_encoder(given, CONFIG, tmp_path)
    assert str(caught.value).startswith(f'encoder: given {given!r}; allowed: amt102, as5047p')
    assert ("did you mean 'amt102'" in str(caught.value)) == ('amt10' in given)


@pytest.mark.parametrize(
    ('keys', 'text'),
    [
        ({'part': None}, 'part: missing'),
        ({'link': 'http://a'}, "link: given 'http://a'"),
        ({'mounting': 'roof'}, "mounting: given 'roof'; allowed: 'motor', 'wheel', 'any' or 'unknown'"),
        ({'encoder': '{sensor: hall}'}, 'encoder.pole_pairs: missing'),
        ({'config': '{rates: 50.0}'}, "velocity_clock, velocity_method; did you mean 'rate'?"),
        ({'config': '{wheel_diameter: 3}'}, 'config.wheel_diameter: given 3; allowed: the keys counter_modulus, rate'),
    ],
)
def test_a_bad_file_gives_one_line(tmp_path, keys, text):
    path = own_file(tmp_path, **keys)
    with pytest.raises(ConfigError) as caught:
        load_encoder(str(path), CONFIG, tmp_path)
    assert str(caught.value).startswith(f'{path}: ') and text in str(caught.value)
    assert '\n' not in str(caught.value)


def test_a_real_encoder_is_called_by_counts_and_file_and_its_counts_follow_from_the_datasheet():
    real = load_encoder('amt102', CONFIG, CONFIG)
    assert (real.label, real.name, real.ppr) == ('8192 amt102', 'amt102', PerWheel(left=8192, right=8192))
    assert real.counts_per_metre(WheelDiameter(left=0.2, right=0.3)) == pytest.approx(8192 / (0.2 * math.pi))
    assert real.overrides['config.encoder.lines'] == 2048 and real.overrides['config.ppr']['left'] == 8192
    assert real.resolution == '2048 lines x 4 = 8192 counts per wheel turn'
    for model, text in (
        ({}, ''),
        ({'lines': 1, 'decoding': 'x1'}, '1 line x 1 = 1 counts per wheel turn'),
        ({'lines': 12, 'side': 'motor', 'gear_ratio': 34.014}, '12 lines x 4 x gear 34.014 = 1632.672 counts'),
        ({'sensor': 'hall', 'pole_pairs': 15}, '15 pole pairs x 6 = 90 counts per wheel turn'),
        ({'sensor': 'absolute', 'bits': 14}, '2^14 = 16384 counts per wheel turn'),
    ):
        assert resolution_text(EncoderModel(**model)).startswith(text) and bool(text) == bool(model)
