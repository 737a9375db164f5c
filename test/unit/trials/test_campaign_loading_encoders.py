"""Real encoders and variants of campaigns: what trials get of them, and contradictions."""

import pytest
import yaml

from campaign_files import ROOT, campaign_file, small_campaign
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.wheels.catalogue import encoder_names

LINES, MISSED = 'config.encoder.lines', 'config.encoder.faults.missed'
REAL = {'tests': ['SL'], 'ppr': [90], 'encoders': ['xl430', 'amt102']}
VARIANTS = {'a none': {}, 'missed 1 %': {MISSED: 0.01}, 'restart': {'config.encoder.faults.restart_at': 20.0}}
RESOLUTION = '2048 lines x 4 = 8192 counts per wheel revolution'


def complaint(folder, replace=None, **changes):
    with pytest.raises(ConfigError) as caught:
        load_campaign(str(campaign_file(folder, **changes)), ROOT, replace)
    assert '\n' not in str(caught.value)
    return str(caught.value)


def test_real_encoders_stand_beside_ideal_ones(tmp_path):
    campaign = small_campaign(tmp_path, **REAL)
    assert [encoder.label for encoder in campaign.encoders] == ['90', '4096 xl430', '8192 amt102']
    trials = [job.definition() for job in campaign.trials()]
    assert [trial.encoder_label for trial in trials] == ['90', '90', *['4096 xl430'] * 2, *['8192 amt102'] * 2]
    assert [trial.resolution for trial in trials[::2]] == ['', '2^12 = 4096 counts per wheel revolution', RESOLUTION]
    assert campaign.trials()[-1].bag[5:] == 'SL_8192_amt102_002.bag'
    ideal, absolute, lines = (cell.robot_params for cell in campaign.cells)
    assert (ideal.encoder.encoder.sensor, absolute.encoder.encoder.sensor) == ('quadrature', 'absolute')
    assert lines.encoder.encoder == lines.odometry.encoder and lines.encoder.counts_per_turn.left == 8192
    assert absolute.encoder.counter_modulus == absolute.odometry.counter_modulus == 2**32


def test_the_catalogue_is_all_of_it(tmp_path):
    campaign = small_campaign(tmp_path, tests=['SL'], ppr=None, encoders=['catalogue'])
    assert [encoder.name for encoder in campaign.encoders] == encoder_names(ROOT / 'config')


def test_an_encoders_file_is_found_beside_the_campaigns(tmp_path):
    amt102 = yaml.safe_load((ROOT / 'config' / 'encoders' / 'amt102.yaml').read_text())
    (tmp_path / 'mine.yaml').write_text(yaml.safe_dump(amt102))
    campaign = small_campaign(tmp_path, tests=['SL'], ppr=None, encoders=['mine.yaml'])
    assert [cell.label for cell in campaign.cells] == ['SL_8192_mine']


@pytest.mark.parametrize(
    ('replace', 'labels'),
    [
        ({'encoders': ['amt102']}, ['8192 amt102']),
        ({'ppr': [40]}, ['40']),
        ({'ppr': [40], 'encoders': ['amt102']}, ['40', '8192 amt102']),
        ({'ppr': None, 'encoders': None}, ['90', '4096 xl430', '8192 amt102']),
    ],
)
def test_either_option_replaces_all_encoders_of_the_file(tmp_path, replace, labels):
    campaign = load_campaign(str(campaign_file(tmp_path, **REAL)), ROOT, replace)
    assert [encoder.label for encoder in campaign.encoders] == labels


def test_set_comes_before_an_encoders_own(tmp_path):
    values = {'config.encoder.eccentricity': 0.0, 'config.rate': 50.0}
    campaign = small_campaign(tmp_path, **REAL, set=values)
    params = campaign.cells[2].robot_params.encoder
    assert (params.encoder.eccentricity, params.encoder.faults.max_count_rate, params.rate) == (0.0, 1.024e6, 50.0)


def test_every_encoder_is_in_the_fingerprint(tmp_path):
    amt102 = yaml.safe_load((ROOT / 'config' / 'encoders' / 'amt102.yaml').read_text())

    def fingerprint(**changes):
        (tmp_path / 'mine.yaml').write_text(yaml.safe_dump({**amt102, **changes}))
        return small_campaign(tmp_path, tests=['SL'], encoders=['xl430', 'mine.yaml']).fingerprint()

    prints = [
        fingerprint(),
        fingerprint(encoder={**amt102['encoder'], 'edge_error': 0.01}),
        fingerprint(config={'rate': 50.0}),
    ]
    assert len(set(prints)) == 3 and fingerprint(name='other') == prints[0]


def test_variants_are_cells_with_parameters_of_their_own(tmp_path):
    campaign = small_campaign(tmp_path, tests=['SL'], ppr=[40, 90], variants=VARIANTS)
    assert [cell.label for cell in campaign.cells][1:4] == ['SL_90_a_none', 'SL_40_missed_1_', 'SL_90_missed_1_']
    assert [cell.varied_texts() for cell in campaign.cells[::2]] == [(('variant', name),) for name in VARIANTS]
    faults = [cell.robot_params.encoder.encoder.faults for cell in campaign.cells[::2]]
    assert [fault.missed for fault in faults] == [0.0, 0.01, 0.0] and faults[2].restart_at == 20.0
    assert [job.definition().variant for job in campaign.trials()[::4]] == list(VARIANTS)


def test_edges_that_are_not_even_go_by_the_ppr_of_each_cell(tmp_path):
    uneven = {'config.encoder.phase_error': 10.0}
    assert len(small_campaign(tmp_path, tests=['SL'], ppr=[40, 1024], set=uneven).cells) == 2
    assert 'ppr: given 90.0; allowed: multiples of 4' in complaint(tmp_path, ppr=[40, 90], set=uneven)


def test_two_files_of_one_name_and_resolution_are_told_apart_by_renaming_one(tmp_path):
    shipped = ROOT / 'config' / 'encoders' / 'amt102.yaml'
    (tmp_path / 'amt102.yaml').write_text(shipped.read_text())
    text = complaint(tmp_path, encoders=['amt102', 'amt102.yaml'])
    assert text.endswith('encoders: given 8192 amt102 2 times; allowed: once; of two files, rename one')


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'set': {LINES: 2048}}, f'config.encoder: given {RESOLUTION} beside ppr: 40; allowed: one of them'),
        (
            {'ppr': None, 'encoders': ['xl430'], 'set': {'config.encoder.bits': 10}},
            'given 2^10 = 1024 counts per wheel revolution beside encoders: 4096 xl430',
        ),
        ({'variants': {'none': {}, 'fine': {LINES: 2048}}}, f'given {RESOLUTION} beside ppr: 40'),
        ({'encoders': ['amt102', 'amt102']}, 'encoders: given 8192 amt102 2 times; allowed: once'),
        ({'encoders': ['amt10']}, "encoder: given 'amt10'; allowed: "),
        ({'variants': {'a': {'config.rat': 1.0}}}, "variants: a: config.rat: unknown key; did you mean 'config.rate'"),
        (
            {'variants': {'a': {MISSED: 0.1}}, 'vary': {MISSED: [0.1]}},
            f'{MISSED}: given under variants and vary; allowed: one of them',
        ),
        ({'variants': {'a': {MISSED: 1.2}}}, 'config: encoder.faults.missed: given 1.2'),
    ],
)
def test_a_contradiction_is_one_line(tmp_path, changes, message):
    text = complaint(tmp_path, **changes)
    assert text.startswith(str(tmp_path / 'small.yaml')) and message in text


def test_a_robots_own_resolution_gives_way(tmp_path):
    content = {'urdf': str(ROOT / 'urdf' / 'alto.urdf.xacro'), 'set': {LINES: 500}}
    (tmp_path / 'mine.yaml').write_text(yaml.safe_dump(content))
    campaign = small_campaign(tmp_path, **REAL, robot='mine.yaml')
    counts = [cell.robot_params.encoder.counts_per_turn.left for cell in campaign.cells]
    assert counts == [90, 4096, 8192]
