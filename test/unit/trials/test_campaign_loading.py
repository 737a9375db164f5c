"""Campaign files: what they mean, and what is wrong with them before anything runs."""

import datetime
import math
import re

import pytest
import yaml

from campaign_files import NOISE, ROOT, campaign_file, small_campaign
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.trials.campaign_loading import load_campaign

MODULUS = 'config.counter_modulus'

TRIALS = {
    'accurate': 360,
    'faults': 1920,
    'paper': 360,
    'paper_tb3': 360,
    'quick': 40,
    'sweep': 300,
}  # of the package's campaigns

VARY = {NOISE: [0.01, 0.03], MODULUS: [0, 65536]}


def complaint(folder, replace=None, **changes):
    """The one line about a file with these changes."""
    with pytest.raises(ConfigError) as caught:
        load_campaign(str(campaign_file(folder, **changes)), ROOT, replace)
    assert '\n' not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(('name', 'trials'), TRIALS.items())
def test_the_packages_campaigns(name, trials):
    campaign = load_campaign(name, ROOT)
    jobs = campaign.trials()
    assert len(jobs) == trials and campaign.params.name == name
    assert len({job.bag[5:] for job in jobs}) == trials
    assert campaign.params.record == 'minimal' and campaign.params.nav == 'embedded'


def test_every_campaign_of_the_package_is_tested_here():
    assert {path.stem for path in (ROOT / 'config' / 'campaigns').glob('*.yaml')} == set(TRIALS)


def test_the_accurate_one_has_the_papers_drives_and_wheels_with_another_filter():
    paper, accurate = (load_campaign(name, ROOT) for name in ('paper', 'accurate'))
    assert [cell.label for cell in accurate.cells] == [cell.label for cell in paper.cells]
    ours, theirs = accurate.cells[0].robot_params, paper.cells[0].robot_params
    assert (ours.simulator, ours.encoder, ours.odometry) == (theirs.simulator, theirs.encoder, theirs.odometry)
    assert ours.amcl == load_params(AmclParams, ROOT / 'config' / 'amcl_accurate.yaml')
    assert load_campaign('quick', ROOT).cells[0].robot_params.amcl == ours.amcl != theirs.amcl


def test_the_two_readings_of_the_paper_differ_where_it_is_silent():
    ours, tb3 = (load_campaign(name, ROOT).cells[0].robot_params for name in ('paper', 'paper_tb3'))
    differing = {
        name: getattr(tb3.amcl, name)
        for name in type(tb3.amcl).model_fields
        if getattr(ours.amcl, name) != getattr(tb3.amcl, name)
    }
    assert differing == {
        'min_particles': 500,
        'update_min_a': 0.2,
        'resample_interval': 1,
        'recovery_alpha_slow': 0.0,
        'recovery_alpha_fast': 0.0,
        **{f'odom_alpha{number}': 0.1 for number in (1, 2, 3, 4)},
    }
    planner = tb3.navigator.DWAPlannerROS
    assert (planner.path_distance_bias, planner.vth_samples, planner.sim_time) == (32.0, 40, 2.0)
    assert tb3.navigator.controller_frequency == 10.0 and not planner.latch_xy_goal_tolerance
    table_2 = (
        'xy_goal_tolerance',
        'yaw_goal_tolerance',
        'goal_distance_bias',
        'max_vel_x',
        'acc_lim_x',
        'acc_lim_theta',
    )
    assert {name: getattr(planner, name) for name in table_2} == {
        name: getattr(ours.navigator.DWAPlannerROS, name) for name in table_2
    }
    assert tb3.simulator == ours.simulator


def test_the_papers_is_the_papers():
    params = load_campaign('paper', ROOT).params
    assert params.tests == ['SL', 'SMT', 'DLD'] and params.trials == 30
    assert [(ppr.left, ppr.right) for ppr in params.ppr] == [(n, n) for n in (40, 90, 1024, 4096)]


def test_jobs_come_by_test_then_varied_parameters_then_ppr_then_trial(tmp_path):
    campaign = small_campaign(tmp_path, vary=VARY)
    jobs = campaign.trials()
    assert [job.position for job in jobs] == list(range(2 * 4 * 2 * 2))
    reported = [
        (cell.test.name, dict(cell.varied)[MODULUS], dict(cell.varied)[NOISE], cell.ppr.left, job.trial)
        for job in jobs
        for cell in [job.cell]
    ]
    assert reported == [
        (test, modulus, noise, ppr, trial)
        for test in ('SL', 'SMT')
        for modulus in (0, 65536)
        for noise in (0.01, 0.03)
        for ppr in (40, 90)
        for trial in (1, 2)
    ]


def test_equal_trials_have_equal_seeds_in_every_cell(tmp_path):
    campaign = small_campaign(tmp_path, seed=100, trials=3, vary=VARY)
    for job in campaign.trials():
        assert job.seed == 100 + job.trial == job.definition().number
    by_cell = {}
    for job in campaign.trials():
        by_cell.setdefault(job.cell.label, []).append(job.seed)
    assert set(map(tuple, by_cell.values())) == {(101, 102, 103)}


def test_a_trial_is_told_as_trial_launch_tells_it(tmp_path):
    campaign = small_campaign(
        tmp_path,
        nav='scripted',
        ppr=[{'left': 40, 'right': 90}],
        set={'config.wheel_separation': 0.41, 'config.wheel_diameter': 0.19},
    )
    trial = campaign.trials()[1].definition()
    assert (trial.ppr.left, trial.ppr.right, trial.number) == (40, 90, 2)
    assert (trial.nav, trial.odom, trial.test.name) == ('scripted', 'encoder', 'SL')
    assert (trial.wheel_separation, trial.wheel_diameter) == (0.41, 0.19)


def test_parameters_reach_their_structs_and_others_stay(tmp_path):
    campaign = small_campaign(
        tmp_path,
        vary=VARY,
        set={
            'simulator.wheel_errors.slip_noise': 1e-6,
            'amcl.max_particles': 500,
            'navigation.DWAPlannerROS.max_vel_x': 0.3,
            'lockstep.command': 0.05,
            'navigation.local_costmap.footprint': [[0.3, 0.3], [0.3, -0.3], [-0.3, 0.0]],
        },
    )
    for cell in campaign.cells:
        params, varied = cell.robot_params, dict(cell.varied)
        assert params.simulator.lidar.noise == varied[NOISE]
        assert params.encoder.counter_modulus == params.odometry.counter_modulus == varied[MODULUS]
        assert params.simulator.wheel_errors.slip_noise == 1e-6
        assert (params.amcl.max_particles, params.amcl.min_particles) == (500, 100)
        assert params.navigator.DWAPlannerROS.max_vel_x == 0.3 and params.latency.command == 0.05
        assert params.navigator.DWAPlannerROS.max_vel_theta == 1.0
        assert params.navigator.local_costmap.footprint[0] == [0.3, 0.3]
        assert params.navigator.global_costmap.footprint[0] == [0.25, 0.3]


def test_the_command_line_comes_before_the_file(tmp_path):
    path = str(campaign_file(tmp_path))
    params = load_campaign(
        path, ROOT, {'tests': ['SMT'], 'ppr': [1024.0], 'trials': 7, 'record': 'none', 'seed': None}
    ).params
    assert (params.tests, params.trials, params.record, params.seed) == (['SMT'], 7, 'none', 0)
    assert params.ppr[0].left == 1024


@pytest.mark.parametrize(
    ('replace', 'expected'),
    [
        ({'trials': 0}, 'trials: given 0; allowed: 1 to 1000000'),
        ({'ppr': [40, -1]}, 'ppr.1: given -1; allowed: 0.001 to 1e9'),
        ({'ppr': [40, 40]}, 'ppr: given 40 2 times; allowed: once'),
        ({'tests': ['XX']}, "test: given 'XX'; allowed: DLD, SL, SMT"),
        ({'record': 'all'}, "record: given 'all'; allowed: 'full', 'minimal' or 'none'"),
        ({'files': {'amcl': 'none'}}, "files.amcl: given 'none'; allowed: amcl, "),
    ],
)
def test_a_mistake_on_the_command_line_is_not_blamed_on_the_file(tmp_path, replace, expected):
    assert complaint(tmp_path, replace).startswith(expected)


@pytest.mark.parametrize(
    ('changes', 'expected'),
    [
        ({'trails': 3}, "trails: unknown key; did you mean 'trials'"),
        ({'overrides': {}}, 'overrides: unk'),
        ({'name': None}, 'name: missing'),
        ({'tests': None}, 'tests: missing'),
        ({'ppr': None}, 'ppr: missing'),
        ({'name': ''}, 'name: given'),
        ({'name': 3}, 'name: given 3'),
        ({'tests': []}, 'tests: given \\[\\]'),
        ({'tests': 'SL'}, "tests: given 'SL'"),
        ({'tests': [3]}, 'tests.0: given 3'),
        ({'ppr': []}, 'ppr: missing; allowed: ppr, encoders, or both'),
        ({'ppr': 40}, 'ppr: given 40'),
        ({'ppr': ['40']}, "ppr.0: given '40'"),
        ({'ppr': [0]}, 'ppr.0: given 0'),
        ({'ppr': [math.nan]}, 'ppr.0: given nan'),
        ({'ppr': [math.inf]}, 'ppr.0: given inf'),
        ({'ppr': [True]}, 'ppr.0: given True'),
        ({'ppr': [{'left': 40}]}, 'ppr.0.right: missing'),
        ({'ppr': [90, 40, 90.0]}, 'ppr: given 90 2 times'),
        ({'ppr': [90, {'left': 90, 'right': 90}]}, 'ppr: given 90 2 times'),
        ({'ppr': [1000001, 1000002]}, 'ppr: given 1e.06 2 times'),
        ({'trials': 0}, 'trials: given 0'),
        ({'trials': 1.5}, 'trials: given 1.5'),
        ({'trials': 10**30}, 'trials: given 10+; allowed: 1 to 1000000'),
        ({'trials': 900_000}, 'given 4 cells of 900000 trials; allowed: at most 10000 cells, 1000000 trials'),
        ({'seed': -1}, 'seed: given -1'),
        ({'seed': 2**70}, 'seed: given'),
        ({'nav': 'upstream'}, "nav: given 'up"),
        ({'record': 'everything'}, "record: given 'every"),
        ({'set': []}, 'set: given'),
        ({'files': 'amcl'}, "files: given 'amcl'; allowed: a mapping"),
        ({'files': {'amcl': 1}}, 'files.amcl: given 1'),
        ({'files': {'slam': 'slam'}}, "files.slam.*: given 'slam'; allowed: 'amcl', 'config', 'lockstep'"),
        ({'files': {'amcl': 'no'}}, "files.amcl: given 'no'; allowed: amcl, .*or a .yaml file"),
        ({'files': {'navigation': 'no/where.yaml'}}, "given 'no/where.yaml'; allowed: navigation, or a .yaml file"),
        ({'vary': [1]}, 'vary: given'),
        ({'tests': ['SL', 'SL']}, 'tests: given SL 2 times'),
        ({'tests': ['XX']}, "test: given 'XX'; allowed: DLD"),
        ({'tests': ['none.yaml']}, "test: given '.*none.yaml'"),
        ({'robot': 'no.xacro'}, "given 'no.xacro', but there is no"),
        ({'tests': ['DLD'], 'nav': 'scripted'}, 'nav: given scripted, but DLD has no drive; allowed: embedded'),
        ({'set': {1: 2}}, 'given the key 1; allowed: text'),
        ({'set': {'amcl': 1}}, 'amcl: unknown key'),
        ({'set': {'slam.delta': 1}}, 'slam.delta: unknown key'),
        ({'set': {'simulator.lidar.nois': 0.1}}, "nois: unknown key; did you mean 'simulator.lidar.noise'"),
        ({'set': {'simulator.lidar': {'noise': 0.1}}}, 'simulator.lidar: unknown key'),
        ({'set': {'simulator.lidar.noise.x': 0.1}}, 'noise.x: unknown key'),
        ({'set': {'config.ppr': 40}}, "config.ppr: every trial sets it; allowed: the campaign's ppr"),
        ({'set': {'amcl.initial_pose_x': 1.0}}, "initial_pose_x: every trial sets it; allowed: the test's start"),
        ({'set': {NOISE: -1}}, 'simulator: lidar.noise: given -1; allowed: 0 to 1000'),
        ({'set': {NOISE: math.nan}}, 'simulator: lidar.noise: given nan; allowed: 0 to 1000'),
        ({'set': {NOISE: '0.1'}}, "lidar.noise: given '0.1'"),
        ({'set': {NOISE: None}}, 'noise: given None'),
        ({'set': {MODULUS: 1}}, 'config: counter_modulus: given 1'),
        ({'set': {MODULUS: 1.5}}, 'modulus: given 1.5'),
        ({'set': {'amcl.max_particles': 50}}, 'amcl: .*at most max_particles'),
        (
            {'set': {'navigation.DWAPlannerROS.latch_xy_goal_tolerance': False}},
            'given False has no effect: another key',
        ),
        ({'vary': {NOISE: 0.1}}, 'vary.simulator.lidar.noise: given 0.1'),
        ({'vary': {NOISE: []}}, 'vary.simulator.lidar.noise: given'),
        ({'vary': {NOISE: [0.1, 0.1]}}, 'simulator.lidar.noise: given 0.1 2 times; allowed: once'),
        ({'vary': {NOISE: [0.1, 'much']}}, "lidar.noise: given 'much'"),
        ({'vary': {NOISE: [datetime.date(2020, 1, 1)]}}, 'given 2020-01-01, which YAML 1.1 takes for a date'),
        # Where ROS is imported, PyYAML reads !!binary as a class of xmlrpc's.
        ({'vary': {NOISE: [b'much']}}, 'lidar.noise: given'),
        ({'vary': {NOISE: [{'a'}]}}, "noise: given {'a'}"),
        ({'vary': {NOISE: [0.1]}, 'set': {NOISE: 0.2}}, 'given under set and vary; allowed: one of them'),
        ({'vary': {NOISE: [n / 1e5 for n in range(9999)]}}, 'given 39996 cells of 2 trials'),
        (
            {'vary': {NOISE: list(range(1000)), MODULUS: list(range(1000)), 'amcl.kld_err': [1] * 1000}},
            'given 4000000000 cells',
        ),
        (
            {'set': {'simulator.left_joint': 'wheel', 'config.left_joint': 'wheel'}},
            "given 'wheel' as left wheel joint, which is missing",
        ),
        ({'set': {'config.left_joint': 'wheel'}}, "config.left_joint: given 'wheel'; allowed: .* left_wheel_joint or"),
        ({'vary': {'simulator.laser_link': ['laser', 'nose']}}, "given 'nose' as laser link, which is missing"),
    ],
)
def test_a_mistake_in_the_file_is_named(tmp_path, changes, expected):
    text = complaint(tmp_path, **changes)
    assert text.startswith(str(tmp_path / 'small.yaml')) and re.search(expected, text), text


def test_files_beside_the_campaigns_are_found_from_it_and_the_users_from_where_they_are(tmp_path, monkeypatch):
    (tmp_path / 'mine.yaml').write_text('name: mine\nworld: hallway\ndrive: [{straight: 1}]\n')
    elsewhere = tmp_path / 'elsewhere'
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    campaign = small_campaign(tmp_path, tests=['mine.yaml'], nav='scripted')
    assert campaign.cells[0].test.name == 'mine'
    path = str(campaign_file(tmp_path, nav='scripted'))
    with pytest.raises(ConfigError, match="^test: given 'mine.yaml'"):
        load_campaign(path, ROOT, {'tests': ['mine.yaml']})
    assert load_campaign(path, ROOT, {'tests': ['../mine.yaml']}).cells[0].test.name == 'mine'


def test_another_file_replaces_one_of_config(tmp_path, monkeypatch):
    (tmp_path / 'mine.yaml').write_text('max_particles: 900\n')
    campaign = small_campaign(tmp_path, files={'amcl': 'mine.yaml'}, set={'amcl.min_particles': 700})
    params = campaign.cells[0].robot_params
    assert (params.amcl.max_particles, params.amcl.min_particles, params.amcl.kld_err) == (900, 700, 0.01)
    default = small_campaign(tmp_path)
    assert params.navigator == default.cells[0].robot_params.navigator
    assert campaign.fingerprint() != default.fingerprint()
    elsewhere = tmp_path / 'elsewhere'
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    path = str(campaign_file(tmp_path, files={'amcl': 'mine.yaml', 'navigation': 'navigation'}))
    for given in ('../mine.yaml', 'amcl'):
        replaced = load_campaign(path, ROOT, {'files': {'amcl': given}})
        assert replaced.params.files == {'amcl': given, 'navigation': 'navigation'}
        assert replaced.cells[0].robot_params.amcl.max_particles == (3000 if given == 'amcl' else 900)
    with pytest.raises(ConfigError, match="^files.amcl: given 'mine.yaml'"):
        load_campaign(path, ROOT, {'files': {'amcl': 'mine.yaml'}})


def test_a_mistake_in_a_file_that_replaces_one_is_its_own(tmp_path):
    (tmp_path / 'mine.yaml').write_text('max_particle: 900\n')
    assert complaint(tmp_path, files={'amcl': 'mine.yaml'}).startswith(
        f"{tmp_path}/mine.yaml: max_particle: unknown key; did you mean 'max_particles'?"
    )


@pytest.mark.parametrize('name', ['nothere', 'no/where.yaml'])
def test_an_unknown_campaign_is_named(name):
    with pytest.raises(
        ConfigError, match='campaign: given .*; allowed: accurate, faults, paper, paper_tb3, quick, sweep, or a'
    ):
        load_campaign(name, ROOT)


def test_bag_names_say_what_was_varied_and_stay_in_their_folder(tmp_path):
    campaign = small_campaign(tmp_path, vary=VARY, tests=['SL'], ppr=[{'left': 40, 'right': 90}])
    assert [job.bag[5:] for job in campaign.trials()][:3] == [
        'SL_40-90_counter_modulus0_noise0.01_001.bag',
        'SL_40-90_counter_modulus0_noise0.01_002.bag',
        'SL_40-90_counter_modulus0_noise0.03_001.bag',
    ]
    names = ['a_b', 'A_B', 'a.b', 'v' * 60]
    for index, name in enumerate(names):
        (tmp_path / f'{index}.yaml').write_text(
            yaml.safe_dump({'name': name, 'world': 'hallway', 'drive': [{'straight': 1}]})
        )
    campaign = small_campaign(
        tmp_path, tests=[f'{index}.yaml' for index in range(len(names))], nav='scripted', ppr=[40]
    )
    bags = [job.bag[5:] for job in campaign.trials()]
    assert len({bag.lower() for bag in bags}) == len(names) * 2
    assert all(re.fullmatch(r'[A-Za-z0-9_.+-]{1,200}', bag) and '/' not in bag for bag in bags)


@pytest.mark.parametrize('name', ['../../x', '/etc/passwd', 'a b', 'a\nb', '.x', 'ü', 'v' * 61])
def test_a_name_that_is_no_file_name_is_refused(tmp_path, name):
    (tmp_path / 't.yaml').write_text(yaml.safe_dump({'name': name, 'world': 'hallway', 'drive': [{'straight': 1}]}))
    assert 't.yaml: name: given' in complaint(tmp_path, tests=['t.yaml'], nav='scripted')
