"""A user's mistake gets one line: where, which key, what was given, what is allowed."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import did_you_mean, load_params, split_params, with_changes
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.odometry.odometry_params import OdometryParams


def test_a_misspelt_key_is_named_with_what_was_probably_meant():
    with pytest.raises(ConfigError, match=r"f\.yaml: pprr: unknown key; did you mean 'ppr'\?"):
        EncoderParams.from_mapping({'pprr': 90}, 'f.yaml')


def test_whole_numbers_are_fine_where_a_length_is_wanted():
    assert OdometryParams.from_mapping({'wheel_separation': 1}, '').wheel_separation == 1.0


def test_params_cannot_be_changed_afterwards():
    with pytest.raises(ValueError, match='frozen'):
        EncoderParams().rate = 10.0


def test_a_shared_file_serves_several_structs_and_still_finds_misspellings():
    encoder, odometry = split_params(
        {'ppr': 40, 'rate': 10.0, 'wheel_diameter': 0.3}, 'c.yaml', EncoderParams, OdometryParams
    )
    assert (encoder.rate, odometry.wheel_diameter, odometry.ppr.left) == (10.0, 0.3, 40)
    with pytest.raises(ConfigError, match=r"c\.yaml: wheel_diametre: unknown.*'wheel_diameter'"):
        split_params({'wheel_diametre': 0.3}, 'c.yaml', EncoderParams, OdometryParams)


@pytest.mark.parametrize(
    ('content', 'complaint'),
    [
        (b'ppr: [1', r'line \d: not valid YAML'),
        (b'- a\n- b\n', 'given a list'),
        (b'ppr: !!python/object/apply:os.system ["false"]', 'not valid YAML'),
        (b'\xff\xfe\x00', 'cannot be read|not valid YAML'),
        (b'ppr: 0\n', 'ppr: given 0'),
    ],
)
def test_a_bad_file_is_named(tmp_path, content, complaint):
    path = tmp_path / 'bad.yaml'
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_params(EncoderParams, path)
    assert str(caught.value).startswith(str(path))
    assert '\n' not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r'nowhere\.yaml: cannot be read: No such file'):
        load_yaml(tmp_path / 'nowhere.yaml')


def test_an_empty_file_means_all_defaults(tmp_path):
    path = tmp_path / 'empty.yaml'
    path.write_text('# nothing\n')
    assert load_params(EncoderParams, path) == EncoderParams()


def test_did_you_mean_is_silent_without_a_likely_word():
    assert did_you_mean('zzz', ['ppr', 'rate']) == ''


def test_changes_are_checked_together_with_what_was_given():
    params = EncoderParams.from_mapping({'ppr': 40}, '')
    changed = with_changes(params, {'rate': 10.0}, '')
    assert (changed.ppr, changed.rate) == (params.ppr, 10.0)
    assert with_changes(changed, {}, '') == changed
    with pytest.raises(ConfigError, match=r'^rate: given -1\.0; allowed: 0\.001 to 1e6'):
        with_changes(params, {'rate': -1.0}, '')
