"""Trials in lockstep: odd tests, odd values of any parameter of config/, and odd rates."""

import yaml

from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.robot_params import CONFIG_FILES, SET_BY_TRIALS, _dotted_keys, load_robot_config
from fuzz_worlds import SMALL
from lockstep_trials import run_trial
from odd_values import odd_mapping, odd_value, pick, write_yaml
from places import ROOT

TIME_LIMIT_S = 2.0
TEST = {
    'name': 'short', 'world': 'ros_logo', 'start': {'x': -3.4, 'y': -0.85, 'yaw': 0.0}, 'time_limit': TIME_LIMIT_S,
    'drive': [{'straight': 0.2}, {'turns': 0.05}], 'pass_radius': 0.5,
    'route': [{'turns': 0.02}, {'through': [{'x': -3.3, 'y': -0.85}]}, {'goal': {'x': -3.2, 'y': -0.85, 'yaw': 0.0}}],
    'limits': {'speed': 0.45, 'acceleration': 0.7, 'angular_speed': 1.0, 'angular_acceleration': 4.9},
}  # fmt: skip
CAMPAIGN = {
    'name': 'odd', 'tests': ['test.yaml'], 'ppr': [90], 'trials': 1, 'seed': 0, 'nav': 'embedded', 'record': 'full',
}  # fmt: skip
PARAMS = [(stem, each) for stem, classes in CONFIG_FILES.items() for each in classes.values()]
KNOWN = {key for stem, each in PARAMS for key in _dotted_keys(each, f'{stem}.')}
KEYS = sorted(KNOWN - set(SET_BY_TRIALS))
RATES = (
    'config.rate', 'simulator.lidar.rate', 'navigation.controller_frequency', 'navigation.planner_frequency',
    'lockstep.odometry', 'lockstep.localization', 'lockstep.command',
)  # fmt: skip
ODD_RATES = (0.0, 0.1, 1.0, 3.0, 7.0, 12.5, 20.0, 33.3, 49.9, 50.0, 99.0, 100.0, 101.0, 1000.0, 1e-3, 0.5, 5.0)


def warm_up(folder):
    (folder / 'test.yaml').write_text(yaml.safe_dump(TEST))
    (folder / 'campaign.yaml').write_text(yaml.safe_dump(CAMPAIGN))
    _use(folder)


def run(rng, folder):
    campaign = {**CAMPAIGN, 'nav': pick(rng, ('embedded', 'scripted')), 'set': _odd_settings(rng)}
    test = odd_mapping(rng, TEST) if rng.random() < 0.3 else TEST
    write_yaml(rng, folder / 'test.yaml', test)
    write_yaml(rng, folder / 'campaign.yaml', odd_mapping(rng, campaign) if rng.random() < 0.1 else campaign)
    (folder / 'small.world').write_text(SMALL)
    _use(folder)


def _odd_settings(rng):
    config = load_robot_config(ROOT / 'config')
    settings = {}
    for _ in range(int(rng.integers(0, 4))):
        key, value = pick(rng, KEYS), config
        for name in key.split('.'):
            value = value.get(name) if isinstance(value, dict) else None
        settings[key] = odd_value(rng, 1.0 if value is None else value)
    if rng.random() < 0.4:
        settings[pick(rng, RATES)] = pick(rng, ODD_RATES)
    return settings


def _use(folder):
    campaign = load_campaign(str(folder / 'campaign.yaml'), ROOT)
    if sum(cell.test.time_limit for cell in campaign.cells) > 10.0 or campaign.params.trials > 5:
        return  # a long trial is no odd one
    for job in campaign.trials():
        files, bag = campaign.files.materialise(folder), str(folder / f'{job.position}.bag')
        plan = TrialPlan(trial=job.definition(), bag=bag, **files.worlds[job.cell.test.name])
        result = run_trial(plan, files.robot, job.cell.robot_params, campaign.params.record)
        assert len(result.reason.splitlines()) <= 1, f'the reason is not one line: {result.reason!r}'
