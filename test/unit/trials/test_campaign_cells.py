"""What is checked before a campaign's trials."""

from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.trials.campaign_cells import CampaignParams, check_robot, unfit_tests
from diff_encoder_sim.trials.campaign_loading import load_campaign
from places import ROOT, WORLDS

WIDE = [[0.3, 0.75], [-0.3, 0.75], [-0.3, -0.75], [0.3, -0.75]]


def campaign(tmp_path, nav='embedded', tests='[SMT, DLD]', **overrides):
    path = tmp_path / 'campaign.yaml'
    settings = ', '.join(f'{key.replace("__", ".")}: {value}' for key, value in overrides.items())
    path.write_text(f'{{name: c, tests: {tests}, ppr: [40, 90], nav: {nav}, set: {{{settings}}}}}')
    return load_campaign(str(path), ROOT)


def test_nothing_speaks_against_a_robot_that_fits(tmp_path):
    assert unfit_tests(campaign(tmp_path), WORLDS) == []


def test_a_robot_too_wide_for_one_test_gets_one_line(tmp_path):
    wide = campaign(tmp_path, navigation__global_costmap__footprint=WIDE, navigation__local_costmap__footprint=WIDE)
    (line,) = unfit_tests(wide, WORLDS)
    assert line.startswith('test DLD: not for this robot: ')


def test_a_robot_too_slow_for_a_time_limit_gets_one_line(tmp_path):
    (line,) = unfit_tests(campaign(tmp_path, simulator__drive__max_linear_speed=0.1), WORLDS)
    assert line.startswith('test DLD: ') and 'time_limit is 600 s' in line


def test_drives_without_feedback_are_not_planned(tmp_path):
    slow = campaign(tmp_path, 'scripted', '[SL]', simulator__drive__max_linear_speed=0.01)
    assert unfit_tests(slow, WORLDS) == []


def test_the_self_check_is_of_the_robot_and_not_of_its_wheel_errors(tmp_path):
    """Else a campaign with wheel errors on purpose would never begin."""
    params = SimulatorParams.from_mapping({'wheel_errors': {'left_radius_error': 0.02}}, '')
    checks = check_robot(campaign(tmp_path).robot.source, params)
    assert [check.name for check in checks if not check.is_ok] == []


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
