"""Advice: the wheel encoder that a robot needs, and other limits of its accuracy."""

from __future__ import annotations

import contextlib
import json
import math
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional

from diff_encoder_sim.advice import advice_tables as tables
from diff_encoder_sim.advice.answers import Criterion, Requirement
from diff_encoder_sim.advice.encoder_search import FORGIVEN, fewest_trials
from diff_encoder_sim.advice.imu_answer import imu_rows
from diff_encoder_sim.advice.odometry_study import (
    BUDGET_COUNTS,
    Advice,
    AdvisedRobot,
    listed_encoders,
    simulated_robot,
    study_odometry,
    with_all_wheels,
    with_budgets,
    with_imus,
)
from diff_encoder_sim.advice.trial_study import TrialsWith, study_trials, switched_off
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.report.about import PageAbout, guide, robot_file, wheels_text
from diff_encoder_sim.analysis.report.answer import NUMBERS, PAGE, report_link
from diff_encoder_sim.analysis.results_table import record_of, trials_table
from diff_encoder_sim.api.campaigns import unrun_text, workers
from diff_encoder_sim.api.notes import name_campaigns_encoders, name_stopping, with_checks
from diff_encoder_sim.api.options import AdviceOptions
from diff_encoder_sim.api.recorded_advice import check_drive_options, robot_of_drive, robot_of_numbers
from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import ImuParams, load_imu
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.robots.wheel_quality import CALIBRATED, QUALITIES, ROBOT_FILE, WheelQuality
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.engine import run_campaign as run_on_workers
from diff_encoder_sim.trials.executors import Workers
from diff_encoder_sim.trials.progress import Progress
from diff_encoder_sim.trials.results import ResultStore, describe_run
from diff_encoder_sim.trials.robot_params import wheel_uncertainty
from diff_encoder_sim.trials.trial_run import RunTrials, run_trials
from diff_encoder_sim.trials.trials_csv import VARIANT
from diff_encoder_sim.wheels.encoder_params import ppr_label
from diff_encoder_sim.wheels.ros_parameters import RosWheels, ros_parameters


def advise(options: AdviceOptions, run: Optional[RunTrials] = None) -> Advice:
    """Find the encoder that a robot needs: print the answers, and write them as a page and JSON.

    ConfigError if an option or a file is invalid; CampaignFault if trials cannot be run.
    """
    began_s = time.monotonic()
    requirement = Requirement(options.share, options.tolerance, math.radians(options.yaw_tolerance), options.confidence)
    options, imus = _checked(options, requirement), _imus(options)
    campaign = None
    if options.drive:
        robot = robot_of_drive(options, options.drive)
    elif options.wheel_diameter:
        robot = robot_of_numbers(options)
    else:
        campaign = with_checks('advise', _candidates(options), options.unchecked)
        name_campaigns_encoders(as_called('advise'), campaign)
        robot = simulated_robot(campaign, options.distance)
        if options.wheels and options.has_trials:
            campaign = _candidates(options, QUALITIES[options.wheels])
    by_wheels = robot.by_wheels()
    advice = study_odometry(robot, by_wheels, requirement, options.wheels)
    print(f'{advice.robot}: {requirement}\n{tables.answers_text(advice)}')
    print(f'  the same in closed form, for quantisation only: {tables.closed_form_text(advice)}', flush=True)
    print(f'{as_called("advise")}: first answer after {time.monotonic() - began_s:.1f} s', file=sys.stderr)
    if imus:
        advice = with_imus(advice, imus, robot.encoder.rate, options.ppr or ())
        texts = [f'{head}: {text}' for head, text in imu_rows(advice.imus)]
        print(tables.filled([*texts, f'assumes {tables.assumptions_text(advice)}']), flush=True)
    advice = with_all_wheels(advice, robot, by_wheels)
    if campaign and options.has_trials:
        name_stopping('advise', campaign, requirement.position_m, options.yaw_tolerance)
        with _candidate_trials(options, campaign, run or run_trials) as trials_with:
            advice = study_trials(campaign, advice, trials_with)
    advice = with_budgets(advice, options.ppr or BUDGET_COUNTS)
    tests = [curve.draws for curve in advice.curves.curves]
    encoders = listed_encoders(tests, package_folder() / 'config', requirement, advice.answers, robot.candidates)
    advice = advice._replace(encoders=encoders)
    if campaign and options.has_trials:
        print(tables.answers_text(advice))
    shown = '\n\n'.join(table.text() for table in tables.advice_tables(advice))
    print(f'\n{shown}\n{tables.own_encoder_text(advice)}')
    exported = ros_parameters(_ros_wheels(advice, robot, options.wheels))
    print(f'\n{exported.ros1}\n')
    options.out.mkdir(parents=True, exist_ok=True)
    for path in exported.write(options.out):
        print(f'Parameters: {path}')
    from diff_encoder_sim.advice.advice_page import write_page  # noqa: PLC0415 - Altair takes a second to import

    write_page(advice, _about(robot, advice, options.out), options.out / PAGE)
    print(f'Page: {options.out / PAGE}')
    content = json.dumps(tables.advice_json(advice), indent=1, allow_nan=False).encode('utf-8')
    for file in filter(None, (options.out / NUMBERS, options.json)):
        write_file(file, content)
    print(f'JSON: {options.json or options.out / NUMBERS}')
    return advice


def _about(robot: AdvisedRobot, advice: Advice, out: Path) -> PageAbout:
    """Return origin and links of the page."""
    left_m, right_m, separation_m = robot.tests[0].robot.assumed.tolist()
    quality = ' and '.join(each.text for each in advice.shown_wheels)
    wheels = wheels_text(2.0 * left_m, 2.0 * right_m, separation_m, quality)
    tests = [draws.drive.requested.test for draws in robot.tests if draws.drive.requested.test.world != 'none']
    links = [*report_link(out), *robot_file(robot.file), *map(guide, ('which_encoder', 'index'))]
    return PageAbout('advise', wheels, links, tests)


def _ros_wheels(advice: Advice, robot: AdvisedRobot, wheels: str) -> RosWheels:
    """Return the robot for other packages, with its own encoder if it suffices, else with the recommended one.

    No real wheel is exact: without `--wheels` or errors of the robot file, the wheels are calibrated.
    """
    answer, drawn, candidates = advice.answers[Criterion.ODOMETRY], robot.tests[0].robot, robot.candidates
    own = next((each for each in candidates if each.params.counts_per_turn.left == robot.own_counts), None)
    enough = (each for each in candidates if each.counts >= (answer.counts or math.inf))
    recommended = (each for each in candidates if each.label == answer.encoder)
    found = next(recommended, None) or next(enough, None) or own or candidates[-1]
    if own and own.counts > found.counts:
        found = own
    usual = ROBOT_FILE if drawn.own_quality == ROBOT_FILE else CALIBRATED
    quality = QUALITIES.get(wheels, usual)
    known: Dict[str, Any] = {'ppr': found.params.ppr, 'encoder': found.params.encoder}
    if quality != ROBOT_FILE:
        known.update(wheel_uncertainty(drawn.with_quality(quality).errors), motion_noise=drawn.slip[2])
    about = f'{advice.robot}, {quality.text}, {found.params.counts_per_turn.left:g} counts per wheel turn'
    return RosWheels(drawn.odometry.model_copy(update=known), about, turn_noise=drawn.slip[3])


def _checked(options: AdviceOptions, requirement: Requirement) -> AdviceOptions:
    """Check options before the computation starts, and set the number of trials."""
    check_drive_options(options)
    if options.drive or options.wheel_diameter:
        options = replace(options, has_trials=False)
    if options.has_trials:
        fewest, trials = fewest_trials(requirement), options.trials
        options = replace(options, trials=fewest_trials(requirement, FORGIVEN) if trials is None else trials)
        if options.distance is not None:
            raise ConfigError(
                f'--distance: given {options.distance:g}, but trials drive the tests; allowed: --no-trials'
            )
        if trials is not None and trials < fewest:
            raise ConfigError(
                f'--trials: given {trials}; allowed: at least {fewest}; fewer cannot show that '
                f'{100 * options.share:g} % of all trials are within the tolerance, even if none fails'
            )
    if options.out.exists() and not options.out.is_dir():
        raise ConfigError(f'--out: given {str(options.out)!r}, a file; allowed: a folder, new or with results')
    if options.json and (options.json.is_dir() or not options.json.parent.is_dir()):
        raise ConfigError(f'--json: given {str(options.json)!r}; allowed: a file in a folder that exists')
    return options


def _imus(options: AdviceOptions) -> Dict[str, ImuParams]:
    """Load the IMUs by their names, or those of their files."""
    found, config = {}, package_folder() / 'config'
    for given in options.imu:
        name = Path(given).stem if given.endswith('.yaml') else given
        if name in found:
            raise ConfigError(f'--imu: given {name!r} twice; allowed: each IMU once')
        found[name] = load_imu(given, config, Path()).imu
    return found


def _candidates(options: AdviceOptions, quality: Optional[WheelQuality] = None) -> Campaign:
    """Load the candidates, by default with the robot's own encoder, and variants that leave out a cause of errors."""
    given = {key: getattr(options, key) for key in ('tests', 'ppr', 'encoders', 'trials', 'robot')}
    given['files'] = None if options.amcl is None else {'amcl': options.amcl}

    def load(values: Mapping[str, Any]) -> Campaign:
        robot = xacro_arguments(options.robot_args), options.packages
        return load_campaign(options.candidates, package_folder(), values, *robot, options.has_trials)

    campaign = load(given)
    if campaign.params.vary or campaign.params.variants:
        varied = f'--candidates: {options.candidates} varies parameters'
        raise ConfigError(f'{varied}; allowed: a campaign without varied parameters')
    own, candidates = campaign.robot.file.ppr, campaign.params.ppr
    more: Dict[str, Any] = {}
    if own and not (options.ppr or campaign.params.encoders or f'{own:g}' in map(ppr_label, candidates)):
        more['ppr'] = [*(ppr.model_dump() for ppr in candidates), own]
    if quality:
        of_wheels = {f'simulator.wheel_errors.{key}': value for key, value in quality.errors.items()}
        more['set'] = {**campaign.params.overrides, **of_wheels}
        campaign = load({**given, **more})
    variants = switched_off([cell.robot_params for cell in campaign.cells])
    if variants and options.has_trials:
        more['variants'] = variants
    return load({**given, **more}) if more else campaign


@contextlib.contextmanager
def _candidate_trials(options: AdviceOptions, campaign: Campaign, run: RunTrials) -> Iterator[TrialsWith]:
    """Open the results folder, and yield a function that returns trials with an encoder and runs missing ones."""
    store = ResultStore(options.out, campaign, describe_run(package_folder(), sys.argv))
    with store, contextlib.ExitStack() as opened:
        ready: List[Workers] = []  # started with the first trial

        def with_encoder(label: str, variant: str) -> pd.DataFrame:
            jobs = [
                job
                for job in store.pending()
                if (job.cell.encoder.label, dict(job.cell.varied).get(VARIANT, '')) == (label, variant)
            ]
            if jobs:
                print(f'{ppr_text(label)}{variant and f", {variant}"}', file=sys.stderr)
                ready[:] = ready or [opened.enter_context(workers(options, len(jobs)))]
                progress = Progress(sys.stderr, campaign, jobs)
                with progress:
                    unrun = run_on_workers(ready[0], campaign, store, progress, jobs, run)
                if unrun:
                    sys.exit(unrun_text('advise', unrun))
            rows = [row for row in store.rows if row.ppr == label and row.trial <= (options.trials or 0)]
            return trials_table(record_of(row) for row in rows if dict(row.varied).get(VARIANT, '') == variant)

        yield with_encoder
        store.finish()
