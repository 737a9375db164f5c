"""Campaign files: what they mean, their fingerprint, and what is wrong with them before anything runs."""

import math
import re
import shutil
from itertools import product

import pytest
import yaml

from campaign_files import NOISE, ROOT, campaign_file, package_copy, small_campaign
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.simulation.simulator import DriveParams, SimulatorParams
from diff_encoder_sim.trials.campaign_cells import check_robot, unfit_tests
from diff_encoder_sim.trials.campaign_loading import as_driven_by, load_campaign
from diff_encoder_sim.trials.results import ResultsFolder
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.trials.trial_run import run_group, run_trials
from diff_encoder_sim.wheels.catalogue import encoder_names
from places import WORLDS
from urdf_texts import usual

MODULUS, RATE = 'config.counter_modulus', 'config.rate'
LINES, MISSED = 'config.encoder.lines', 'config.encoder.faults.missed'
VARY = {NOISE: [0.01, 0.03], MODULUS: [0, 65536]}
# Trials of the package's campaigns.
TRIALS = {'accurate': 360, 'faults': 1920, 'paper': 360, 'paper_tb3': 360, 'quick': 40, 'sweep': 300}
REAL = {'tests': ['SL'], 'ppr': [90], 'encoders': ['xl430', 'amt102']}
RESOLUTION = '2048 lines x 4 = 8192 counts per wheel turn'
AMT102 = yaml.safe_load((ROOT / 'config' / 'encoders' / 'amt102.yaml').read_text())
URDF = ROOT / 'urdf' / 'alto.urdf.xacro'


def complaint(folder, replace=None, **changes):
    """The one line about a file with these changes."""
    with pytest.raises(ConfigError) as caught:
        load_campaign(str(campaign_file(folder, **changes)), ROOT, replace)
    assert '\n' not in str(caught.value)
    return str(caught.value)


def write(path, content):
    path.write_text(yaml.safe_dump(content), encoding='utf-8')
    return path


# ---- the package's campaigns


@pytest.mark.parametrize('path', sorted((ROOT / 'config' / 'campaigns').glob('*.yaml')), ids=lambda path: path.stem)
def test_a_campaign_of_the_package_has_its_trials_and_one_comes_to_its_goal(path, tmp_path):
    name, campaign = path.stem, load_campaign(path.stem, ROOT)
    trials = campaign.trials()
    assert len(trials) == len({trial.bag for trial in trials}) == TRIALS[name]
    assert (campaign.params.name, campaign.params.record, campaign.params.nav) == (name, 'minimal', 'embedded')
    short = load_campaign(name, ROOT, {'tests': ['SMT'], 'ppr': [90.0], 'trials': 1, 'record': 'none'})
    files = short.files.materialise(tmp_path)
    ((row, bag),) = run_group(files, short.trials()[:1], ResultsFolder('', ''), run_trials)
    assert (row.outcome, row.reason, row.bag, bag) == (Outcome.SUCCEEDED, '', '', None)
    assert 30.0 < row.duration_s < 90.0


def test_the_papers_campaigns_differ_in_the_filter_or_where_the_paper_is_silent():
    paper, accurate, quick, tb3 = (load_campaign(name, ROOT) for name in ('paper', 'accurate', 'quick', 'paper_tb3'))
    assert paper.params.tests == ['SL', 'SMT', 'DLD'] and paper.params.trials == 30
    assert [encoder.label for encoder in paper.encoders] == ['40', '90', '1024', '4096']
    assert [cell.label for cell in accurate.cells] == [cell.label for cell in paper.cells]
    ours, other, theirs, fast = (each.cells[0].robot_params for each in (accurate, tb3, paper, quick))
    assert (ours.simulator, ours.encoder, ours.odometry) == (theirs.simulator, theirs.encoder, theirs.odometry)
    assert load_params(AmclParams, ROOT / 'config' / 'amcl_accurate.yaml') == ours.amcl == fast.amcl != theirs.amcl
    assert set(other.amcl.model_dump().items()) - set(theirs.amcl.model_dump().items()) == {
        ('min_particles', 500),
        ('update_min_a', 0.2),
        ('resample_interval', 1),
        ('recovery_alpha_slow', 0.0),
        ('recovery_alpha_fast', 0.0),
        *((f'odom_alpha{number}', 0.1) for number in (1, 2, 3, 4)),
    }
    assert other.simulator == theirs.simulator


# ---- trials and parameters


def test_trials_come_by_test_then_varied_parameters_then_ppr_with_equal_seeds_in_each_cell(tmp_path):
    trials = small_campaign(tmp_path, vary=VARY, seed=100).trials()
    assert [trial.position for trial in trials] == list(range(2 * 4 * 2 * 2))
    cells = [(trial.cell, trial.trial) for trial in trials]
    found = [(cell.test.name, *dict(cell.varied).values(), cell.encoder.ppr.left, number) for cell, number in cells]
    assert found == list(product(('SL', 'SMT'), (0, 65536), (0.01, 0.03), (40, 90), (1, 2)))
    assert all(trial.seed == 100 + trial.trial == trial.definition().number for trial in trials)


def test_parameters_reach_their_structs_and_the_trials_definition_and_others_stay(tmp_path):
    values = {
        'config.wheel_separation': 0.41,
        'amcl.max_particles': 500,
        'lockstep.command': 0.05,
        'navigation.local_costmap.footprint': [[0.3, 0.3], [0.3, -0.3], [-0.3, 0.0]],
    }
    campaign = small_campaign(tmp_path, vary=VARY, set=values, nav='scripted', ppr=[{'left': 40, 'right': 90}])
    for cell in campaign.cells:
        params, varied = cell.robot_params, dict(cell.varied)
        assert params.simulator.lidar.noise == varied[NOISE]
        assert params.encoder.counter_modulus == params.odometry.counter_modulus == varied[MODULUS]
        assert (params.amcl.max_particles, params.amcl.min_particles, params.latency.command) == (500, 100, 0.05)
        assert params.navigator.local_costmap.footprint[0] == [0.3, 0.3]
        assert params.navigator.global_costmap.footprint[0] == [0.25, 0.3]
    trial = campaign.trials()[1].definition()
    assert (trial.ppr.left, trial.ppr.right, trial.number, trial.wheel_separation) == (40, 90, 2, 0.41)
    assert (trial.nav, trial.odom, trial.test.name) == ('scripted', 'encoder', 'SL')


def test_bag_names_contain_what_was_varied_and_stay_in_their_folder(tmp_path):
    campaign = small_campaign(tmp_path, vary=VARY, tests=['SL'], ppr=[{'left': 40, 'right': 90}])
    assert [trial.bag for trial in campaign.trials()][1:3] == [
        'bags/SL_40-90_counter_modulus0_noise0.01_002.bag',
        'bags/SL_40-90_counter_modulus0_noise0.03_001.bag',
    ]
    for number, name in enumerate(['a_b', 'A_B', 'a.b', 'v' * 60]):
        write(tmp_path / f'{number}.yaml', {'name': name, 'world': 'hallway', 'drive': [{'straight': 1}]})
    tests = [f'{number}.yaml' for number in range(4)]
    bags = [trial.bag for trial in small_campaign(tmp_path, tests=tests, nav='scripted', ppr=[40]).trials()]
    assert len({bag.lower() for bag in bags}) == 4 * 2
    assert all(re.fullmatch(r'bags/[A-Za-z0-9_.+-]{1,200}', bag) for bag in bags)


def test_a_test_is_driven_no_faster_than_the_motors_allow():
    test = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'drive': [{'straight': 2.0}]}, '')
    assert as_driven_by(SimulatorParams(), test) is test
    limits = DriveParams(max_linear_speed=0.1, max_angular_acceleration=1.0)
    slow = as_driven_by(SimulatorParams(drive=limits), test)
    slower = {'speed': 0.1, 'angular_acceleration': 1.0}
    assert slow == test.model_copy(update={'limits': test.limits.model_copy(update=slower)})
    assert ScriptedDrive(slow).duration_s > 20.0 > ScriptedDrive(test).duration_s


def test_a_pivot_is_an_arc_about_the_standing_wheel():
    segments = [{'pivot': {'wheel': wheel, 'turns': turns}} for wheel in ('left', 'right') for turns in (0.25, -0.25)]
    test = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'path': segments}, '')
    driven = as_driven_by(SimulatorParams(wheel_separation=0.6), test)
    for segment, pivot in zip(driven.drive, segments):
        distance_m, turn_rad = segment.motion
        side = 1.0 if pivot['pivot']['wheel'] == 'left' else -1.0
        # The standing wheel is half the separation to its side of the middle.
        assert distance_m - side * 0.3 * turn_rad == pytest.approx(0.0, abs=1e-12)
    assert as_driven_by(SimulatorParams(wheel_separation=0.5), driven) == driven


def test_a_path_without_a_route_or_a_map_is_enough_without_trials():
    given = {'tests': ['UMBMARK'], 'ppr': [90.0]}
    assert load_campaign('sweep', ROOT, given, has_trials=False).tests[0].drive
    with pytest.raises(ConfigError, match='but UMBMARK has no route; allowed: scripted, advise --no-trials'):
        load_campaign('sweep', ROOT, given)


# ---- encoders and variants


def test_real_encoders_follow_ideal_ones(tmp_path):
    campaign = small_campaign(tmp_path, **REAL)
    trials = [trial.definition() for trial in campaign.trials()[::2]]
    labels = ['90', '4096 xl430', '8192 amt102']
    assert [trial.encoder_label for trial in trials] == [encoder.label for encoder in campaign.encoders] == labels
    assert [trial.resolution for trial in trials] == ['', '2^12 = 4096 counts per wheel turn', RESOLUTION]
    assert campaign.trials()[-1].bag == 'bags/SL_8192_amt102_002.bag'
    ideal, absolute, lines = (cell.robot_params for cell in campaign.cells)
    assert (ideal.encoder.encoder.sensor, absolute.encoder.encoder.sensor) == ('quadrature', 'absolute')
    assert lines.encoder.encoder == lines.odometry.encoder and lines.encoder.counts_per_turn.left == 8192
    assert absolute.encoder.counter_modulus == absolute.odometry.counter_modulus == 2**32
    catalogue = small_campaign(tmp_path, tests=['SL'], ppr=None, encoders=['catalogue'])
    assert [encoder.name for encoder in catalogue.encoders] == encoder_names(ROOT / 'config')
    write(tmp_path / 'mine.yaml', AMT102)
    own = small_campaign(tmp_path, tests=['SL'], ppr=None, encoders=['mine.yaml'])
    assert [cell.label for cell in own.cells] == ['SL_8192_mine']


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


def test_set_overrides_an_encoder_and_an_encoder_overrides_the_robots(tmp_path):
    write(tmp_path / 'mine.yaml', {'urdf': str(URDF), 'set': {LINES: 500}})
    values = {'config.encoder.eccentricity': 0.0, 'config.rate': 50.0}
    campaign = small_campaign(tmp_path, **REAL, robot='mine.yaml', set=values)
    assert [cell.robot_params.encoder.counts_per_turn.left for cell in campaign.cells] == [90, 4096, 8192]
    params = campaign.cells[2].robot_params.encoder
    assert (params.encoder.eccentricity, params.encoder.faults.max_count_rate, params.rate) == (0.0, 1.024e6, 50.0)


def test_variants_are_cells_that_override_set_and_are_multiplied_by_varied_parameters(tmp_path):
    variants = {'a none': {}, 'missed 1 %': {MISSED: 0.01}, 'slow': {RATE: 5.0}}
    changes = {'tests': ['SL'], 'set': {RATE: 10.0}, 'variants': variants}
    campaign = small_campaign(tmp_path, **changes)
    assert [cell.label for cell in campaign.cells][1:4] == ['SL_90_a_none', 'SL_40_missed_1_', 'SL_90_missed_1_']
    assert [cell.varied for cell in campaign.cells[::2]] == [(('variant', name),) for name in variants]
    params = [cell.robot_params.encoder for cell in campaign.cells[::2]]
    assert [(each.rate, each.encoder.faults.missed) for each in params] == [(10.0, 0.0), (10.0, 0.01), (5.0, 0.0)]
    assert [trial.definition().variant for trial in campaign.trials()[::4]] == list(variants)
    cells = small_campaign(tmp_path, vary={NOISE: [0.01, 0.03]}, **changes).cells
    assert [tuple(dict(cell.varied).values()) for cell in cells[::2]] == list(product((0.01, 0.03), variants))


# ---- mistakes


@pytest.mark.parametrize(
    ('replace', 'expected'),
    [
        ({'trials': 0}, 'trials: given 0; allowed: 1 to 1000000'),
        ({'ppr': [40, 40]}, 'ppr: given 40 2 times; allowed: once'),
        ({'tests': ['XX']}, "test: given 'XX'; allowed: DLD, SL, SMT, UMBMARK"),
        ({'files': {'amcl': 'none'}}, "files.amcl: given 'none'; allowed: amcl, "),
    ],
)
def test_a_mistake_on_the_command_line_is_not_blamed_on_the_file(tmp_path, replace, expected):
    assert complaint(tmp_path, replace).startswith(expected)
    with pytest.raises(ConfigError, match='campaign: given .*; allowed: accurate, faults, paper, paper_tb3, quick, '):
        load_campaign('nothere', ROOT)


@pytest.mark.parametrize(
    ('changes', 'expected'),
    [
        ({'trails': 3}, "trails: unknown key; did you mean 'trials'"),
        ({'tests': None}, 'tests: missing'),
        ({'ppr': None}, 'ppr: missing; allowed: ppr, encoders, or both'),
        ({'trials': 900_000}, 'given 4 cells of 900000 trials; allowed: at most 10000 cells, 1000000 trials'),
        ({'nav': 'upstream'}, "nav: given 'up"),
        ({'files': {'navigation': 'no/where.yaml'}}, "given 'no/where.yaml'; allowed: navigation, or a .yaml file"),
        ({'tests': ['SL', 'SL']}, 'tests: given SL 2 times'),
        ({'robot': 'no.xacro'}, "given 'no.xacro', but there is no"),
        ({'tests': ['DLD'], 'nav': 'scripted'}, 'nav: given scripted, but DLD has no path; allowed: embedded'),
        ({'set': {'simulator.lidar.nois': 0.1}}, "nois: unknown key; did you mean 'simulator.lidar.noise'"),
        ({'set': {'config.ppr': 40}}, "config.ppr: every trial sets it; allowed: the campaign's ppr"),
        ({'set': {NOISE: math.nan}}, 'simulator: lidar.noise: given nan; allowed: 0 to 1000'),
        ({'set': {'navigation.DWAPlannerROS.latch_xy_goal_tolerance': False}}, 'has no effect: another key'),
        ({'vary': {NOISE: [{'a'}]}}, "noise: given {'a'}"),
        ({'vary': {NOISE: [0.1]}, 'set': {NOISE: 0.2}}, 'given under set and vary; allowed: one of them'),
        ({'vary': {key: [1] * 1000 for key in (NOISE, MODULUS, 'amcl.kld_err')}}, 'given 4000000000 cells'),
        ({'set': {'config.left_joint': 'wheel'}}, "config.left_joint: given 'wheel'; allowed: .* left_wheel_joint or"),
        ({'vary': {'simulator.laser_link': ['laser', 'nose']}}, "given 'nose' as laser link, which is missing"),
        ({'set': {LINES: 2048}}, f'config.encoder: given {RESOLUTION} and ppr: 40; allowed: one of them'),
        ({'ppr': [40, 90], 'set': {'config.encoder.phase_error': 10.0}}, 'ppr: given 90.0; allowed: multiples of 4'),
        ({'variants': {'a': {'config.rat': 1.0}}}, "variants: a: config.rat: unknown key; did you mean 'config.rate'"),
        ({'imu': 'bno05'}, "imu: given 'bno05'; allowed: bmi088, bno055, mpu6050, stim300, or a .yaml file"),
        ({'variants': {'a': {'imu': 5}}}, "imu: given '5'; allowed: bmi088, "),
        ({'set': {'imu': 'bno055'}}, 'imu: unknown key'),
        ({'fusion': 'embedded'}, 'fusion: given embedded without an IMU; allowed: with an IMU, such as mpu6050'),
        (
            {'imu': 'bno055', 'vary': {'fusion': ['none', 'upstream']}},
            "fusion: given 'upstream'; allowed: 'none' or 'embedded'",
        ),
        ({'imu': 'bno055', 'set': {'simulator.imu.rate': 33.0}}, 'simulator: imu: given .*; allowed: a rate whose'),
        ({'variants': {'a': {MISSED: 0.1}}, 'vary': {MISSED: [0.1]}}, 'given under variants and vary; allowed: one'),
    ],
)
def test_a_mistake_in_the_file_is_named(tmp_path, changes, expected):
    text = complaint(tmp_path, **changes)
    assert text.startswith(str(tmp_path / 'small.yaml')) and re.search(expected, text), text


def test_an_imu_is_one_of_all_cells_or_of_some(tmp_path):
    def noises(**changes):
        campaign = small_campaign(tmp_path, tests=['SL'], ppr=[40], **changes)
        imus = [cell.robot_params.simulator.imu for cell in campaign.cells]
        return {cell.label: imu and imu.gyroscope.noise_density for cell, imu in zip(campaign.cells, imus)}

    bno055, stim300 = 2.443e-4, 4.363e-5
    assert noises() == noises(imu='none') == {'SL_40': None}
    assert noises(imu='bno055') == {'SL_40': bno055}
    assert noises(vary={'imu': ['none', 'bno055']}) == {'SL_40_imunone': None, 'SL_40_imubno055': bno055}
    assert noises(imu='stim300', variants={'a': {}, 'b': {'imu': 'bno055'}}) == {'SL_40_a': stim300, 'SL_40_b': bno055}
    quiet = {'simulator.imu.gyroscope.noise_density': 1e-6}
    assert noises(imu='bno055', set=quiet) == noises(set=quiet) == {'SL_40': 1e-6}
    write(tmp_path / 'mine.yaml', yaml.safe_load((ROOT / 'config' / 'imu' / 'bno055.yaml').read_text()))
    assert noises(imu='mine.yaml') == {'SL_40': bno055}
    assert 'imu' not in small_campaign(tmp_path).resolved()['parameters'][0]['simulator']


def test_fusion_is_that_of_all_cells_or_of_some(tmp_path):
    def fusions(**changes):
        campaign = small_campaign(tmp_path, tests=['SL'], ppr=[40], imu='bno055', trials=1, **changes)
        return {each.cell.label: each.definition().fusion for each in campaign.trials()}

    assert fusions(fusion='embedded') == {'SL_40': 'embedded'}
    varied = {'SL_40_fusionnone': 'none', 'SL_40_fusionembedded': 'embedded'}
    assert fusions(vary={'fusion': ['none', 'embedded']}) == varied
    assert fusions(variants={'a': {}, 'b': {'fusion': 'embedded'}}) == {'SL_40_a': 'none', 'SL_40_b': 'embedded'}
    without, having = (small_campaign(tmp_path, **changes).resolved() for changes in ({}, {'imu': 'bno055'}))
    assert 'fusion' not in without['parameters'][0] and 'fusion' not in without
    assert having['parameters'][0]['fusion']['frequency'] == 100.0


def test_slip_by_motion_is_varied_by_its_key_and_without_it_older_campaigns_can_be_completed(tmp_path):
    key = 'simulator.wheel_errors.slip.lateral_acceleration'
    campaign = small_campaign(tmp_path, tests=['SL'], ppr=[40], vary={key: [0.0, 0.01]})
    slips = [cell.robot_params.simulator.wheel_errors.slip.lateral_acceleration for cell in campaign.cells]
    assert slips == [0.0, 0.01]
    saved = [each['simulator']['wheel_errors'] for each in campaign.resolved()['parameters']]
    assert ['slip' in errors for errors in saved] == [False, True]
    assert 'floor' not in campaign.resolved()['tests'][0]


# ---- the fingerprint, and the checks before trials


def test_any_change_changes_the_fingerprint_and_names_and_order_do_not(tmp_path):

    def fingerprint(encoder=None, **changes):
        write(tmp_path / 'mine.yaml', {**AMT102, **(encoder or {})})
        encoders = {'encoders': ['xl430', 'mine.yaml']} if encoder is not None else {}
        return small_campaign(tmp_path, **encoders, **changes).fingerprint()

    one, edges = {'amcl.kld_err': 0.03, RATE: 10.0}, {**AMT102['encoder'], 'edge_error': 0.01}
    changes = [{}, {'trials': 3}, {'seed': 1}, {'ppr': [40, 91]}, {'tests': ['SL']}, {'tests': ['SMT', 'SL']}]
    changes += [
        {'nav': 'scripted'},
        {'record': 'full'},
        {'bag_format': 'mcap'},
        {'imu': 'bno055'},
        {'set': one},
        {'vary': VARY},
    ]
    changes += [{'vary': {**VARY, MODULUS: [0, 256]}}, {'set': {**one, RATE: 11.0}}, {'encoder': {}}]
    changes += [{'encoder': {'encoder': edges}}, {'encoder': {'config': {'rate': 50.0}}}]
    prints = [fingerprint(**each) for each in changes]
    assert len(set(prints)) == len(prints)
    assert fingerprint(name='other') == prints[0]
    assert fingerprint(encoder={'part': 'other'}) == fingerprint(encoder={})
    both = [{'set': dict(pairs), 'vary': VARY} for pairs in (one.items(), reversed(list(one.items())))]
    assert fingerprint(**both[0]) == fingerprint(**dict(reversed(list(both[1].items()))))


@pytest.mark.parametrize(
    ('name', 'old', 'new'),
    [
        ('config/config.yaml', b'max_wheel_speed: 100.0', b'max_wheel_speed: 101.0'),
        ('config/amcl.yaml', b'kld_err: 0.02', b'kld_err: 0.021'),
        ('config/tests/SL.yaml', b'x: 10.0', b'x: 10.5'),
        ('worlds/hallway.world', b'</sdf>', b'</sdf> '),
        ('urdf/alto.urdf.xacro', b'</robot>', b'</robot> '),
        ('worlds/hallway.pgm', b'\xfe', b'\xcd'),
        ('worlds/hallway.yaml', b'0.196', b'0.197'),
    ],
)
def test_every_parameter_and_byte_that_trials_read_is_in_the_fingerprint(tmp_path, name, old, new):
    package, path = package_copy(tmp_path / 'package'), str(campaign_file(tmp_path))
    before = load_campaign(path, package).fingerprint()
    content = (package / name).read_bytes()
    assert old in content
    (package / name).write_bytes(content.replace(old, new, 1))
    assert load_campaign(path, package).fingerprint() != before


def test_only_navigated_tests_are_judged_by_the_robots_size_and_speed(tmp_path):
    changes = {'tests': ['SL'], 'set': {'simulator.drive.max_linear_speed': 0.01}}
    unfit = [unfit_tests(small_campaign(tmp_path, nav=nav, **changes), WORLDS) for nav in ('embedded', 'scripted')]
    assert list(map(len, unfit)) == [1, 0]


def test_the_self_check_is_of_the_robot_and_not_of_its_wheel_errors(tmp_path):
    """Else a campaign with wheel errors on purpose would never begin."""
    errors = SimulatorParams.from_mapping({'wheel_errors': {'left_radius_error': 0.02}}, '')
    checks = check_robot(small_campaign(tmp_path).robot.file.source, errors)
    assert [check.name for check in checks if not check.is_ok] == []


# ---- files next to the campaign's, and robots


def test_files_are_relative_to_the_campaigns_file_or_to_the_current_folder(tmp_path, monkeypatch):
    write(tmp_path / 'test.yaml', {'name': 'mine', 'world': 'hallway', 'drive': [{'straight': 1}]})
    write(tmp_path / 'mine.yaml', {'max_particles': 900})
    (tmp_path / 'elsewhere').mkdir()
    monkeypatch.chdir(tmp_path / 'elsewhere')
    files = {'amcl': 'mine.yaml', 'navigation': 'navigation'}
    path = str(campaign_file(tmp_path, tests=['test.yaml'], nav='scripted', files=files))
    cell, default = load_campaign(path, ROOT).cells[0], small_campaign(tmp_path).cells[0].robot_params
    assert cell.test.name == 'mine' and cell.robot_params.navigator == default.navigator
    assert (cell.robot_params.amcl.max_particles, cell.robot_params.amcl.kld_err) == (900, 0.01)
    campaign_file(tmp_path, tests=['test.yaml'], nav='scripted', files=files)
    assert load_campaign(path, ROOT, {'tests': ['../test.yaml']}).cells[0].test.name == 'mine'
    for given, particles in (('../mine.yaml', 900), ('amcl', 3000)):
        replaced = load_campaign(path, ROOT, {'files': {'amcl': given}})
        assert replaced.params.files == {**files, 'amcl': given}
        assert replaced.cells[0].robot_params.amcl.max_particles == particles
    mistakes = {'tests': ['test.yaml']}, {'files': {'amcl': 'mine.yaml'}}
    for replace, expected in zip(mistakes, ("^test: given 'test.yaml'", "^files.amcl: given 'mine.yaml'")):
        with pytest.raises(ConfigError, match=expected):
            load_campaign(path, ROOT, replace)


def campaign_of(robot, **replace):
    return load_campaign('quick', ROOT, {'robot': str(robot), **replace})


def test_a_robots_numbers_reach_every_cell_and_the_campaign_overrides_them(tmp_path):
    default, alto = load_campaign('quick', ROOT), campaign_of(ROOT / 'config' / 'robots' / 'alto.yaml')
    assert [cell.robot_params for cell in alto.cells] == [cell.robot_params for cell in default.cells]
    assert (alto.files, alto.fingerprint()) == (default.files, default.fingerprint())
    values = {'config.wheel_separation': 0.5, 'simulator.drive.max_linear_speed': 0.2, NOISE: 0.02}
    path = write(tmp_path / 'robot.yaml', {'urdf': str(URDF), 'set': values})
    other = campaign_of(path)
    params = [cell.robot_params for cell in other.cells]
    assert {(each.odometry.wheel_separation, each.simulator.lidar.noise) for each in params} == {(0.5, 0.02)}
    assert {cell.test.limits.speed for cell in other.cells} == {0.2}
    assert other.trials()[0].definition().wheel_separation == 0.5
    assert other.fingerprint() != default.fingerprint()
    (cell,) = small_campaign(tmp_path, tests=['SL'], ppr=[90], robot='robot.yaml', set={NOISE: 0.05}).cells
    assert cell.robot_params.simulator.lidar.noise == 0.05


def test_only_closed_loop_trials_need_a_laser(tmp_path):
    blind = tmp_path / 'blind.urdf'
    blind.write_text(usual(), encoding='utf-8')
    with pytest.raises(ConfigError, match=r'blind.urdf: the robot has no laser, .*laser: \{parent: base_link, xyz: '):
        campaign_of(blind)
    without_trials = load_campaign('quick', ROOT, {'robot': str(blind)}, has_trials=False)
    for taken in (campaign_of(blind, tests=['SL'], nav='scripted'), without_trials):
        (warning,) = [text for text in taken.robot.description.warnings if 'laser' in text]
        assert 'laser: {parent: base_link, xyz: ' in warning


def test_arguments_of_a_xacro_and_folders_of_packages_reach_its_file(tmp_path):
    noisy = load_campaign('quick', ROOT, {'robot': str(URDF)}, {'lidar_noise': '0.25'})
    assert {cell.robot_params.simulator.lidar.noise for cell in noisy.cells} == {0.25}
    with pytest.raises(ConfigError, match="argument 'lidar_nose' is not known; did you mean 'lidar_noise'"):
        load_campaign('quick', ROOT, {'robot': str(URDF)}, {'lidar_nose': '0.25'})
    package = tmp_path / 'elsewhere' / 'my_description'
    package.mkdir(parents=True)
    (package / 'package.xml').write_text('<package><name>my_description</name></package>')
    shutil.copy(str(URDF), str(package / 'parts.xacro'))
    own, include = tmp_path / 'robot.urdf.xacro', '<xacro:include filename="$(find my_description)/parts.xacro"/>'
    own.write_text(f'<robot name="mine" xmlns:xacro="http://www.ros.org/wiki/xacro">{include}</robot>')
    assert load_campaign('quick', ROOT, {'robot': str(own)}, {}, [tmp_path / 'elsewhere']).robot.name == 'mine'
