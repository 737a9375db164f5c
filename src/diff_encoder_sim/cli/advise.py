"""advise: which wheel encoder a robot needs. Its help is in advise_arguments."""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from typing import Any, Dict, Mapping, Optional, Sequence

from diff_encoder_sim.advice.advice import Advice
from diff_encoder_sim.advice.advice_json import advice_json
from diff_encoder_sim.advice.advice_page import write_page
from diff_encoder_sim.advice.advice_text import answers_text, closed_form_text, own_encoder_text, tables_text
from diff_encoder_sim.advice.candidates import candidates_of
from diff_encoder_sim.advice.evidence import looks
from diff_encoder_sim.advice.listed_encoders import listed_encoders
from diff_encoder_sim.advice.odometry_study import study_odometry, with_budgets
from diff_encoder_sim.advice.rank_judge import Asked, fewest_trials
from diff_encoder_sim.advice.requirement import Requirement
from diff_encoder_sim.advice.switched_causes import switched_off
from diff_encoder_sim.advice.trial_study import TrialStudy
from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.cli.advise_arguments import parse
from diff_encoder_sim.cli.amcl_argument import chosen_files
from diff_encoder_sim.cli.candidate_trials import CandidateTrials
from diff_encoder_sim.cli.encoder_notes import name_campaigns_encoders
from diff_encoder_sim.cli.robot_checks import with_checks
from diff_encoder_sim.cli.stopping_spread import name_stopping
from diff_encoder_sim.cli.trial_workers import run_trials_tool
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.trial_run import run_trials
from diff_encoder_sim.trials.worker import RunTrials
from diff_encoder_sim.wheels.encoder_params import ppr_label

# Trials go on as long as those that fail are fewer than this, where the others show the share.
FORGIVEN = 5
PAGE = 'advice.html'


def main(arguments: Optional[Sequence[str]] = None, run: RunTrials = run_trials) -> None:
    """Run the command line; `run` runs trials on a worker."""
    options = parse(arguments)
    run_trials_tool('advise', lambda: _advise(options, run))


def _advise(options: argparse.Namespace, run: RunTrials) -> None:
    began_s = time.monotonic()
    _check_trials(options)
    _check_outputs(options)
    requirement = Requirement(options.share, options.tolerance, math.radians(options.yaw_tolerance), options.confidence)
    campaign = with_checks('advise', _candidates(options), options.unchecked)
    name_campaigns_encoders(as_called('advise'), campaign)
    advice = study_odometry(campaign, requirement, options.distance)
    print(f'{advice.robot}: {requirement}\n{answers_text(advice)}')
    print(f'  the same in closed form, of quantisation alone: {closed_form_text(advice)}', flush=True)
    print(f'{as_called("advise")}: first answer after {time.monotonic() - began_s:.1f} s', file=sys.stderr)
    if options.has_trials:
        name_stopping('advise', campaign, requirement.position_m, options.yaw_tolerance)
        with CandidateTrials(options, campaign, run) as trials:
            advice = TrialStudy(campaign, advice, trials.with_encoder, options.trials).advice()
    _finish(advice, campaign, options)


def _finish(advice: Advice, campaign: Campaign, options: argparse.Namespace) -> None:
    """Add what is not waited for, print all of it, and write the files."""
    advice = with_budgets(advice)
    tests = [curve.draws for curve in advice.curves.curves]
    config, candidates = package_folder() / 'config', candidates_of(campaign)
    known = listed_encoders(tests, config, advice.requirement, advice.answers, candidates)
    advice = advice._replace(encoders=known)
    if options.has_trials:
        print(answers_text(advice))
    print(f'\n{tables_text(advice)}\n{own_encoder_text(advice)}')
    page = options.out / PAGE
    page.parent.mkdir(parents=True, exist_ok=True)
    write_page(advice, page)
    print(f'Page: {page}')
    if options.json:
        write_file(options.json, json.dumps(advice_json(advice), indent=1, allow_nan=False).encode('utf-8'))
        print(f'JSON: {options.json}')


def _check_outputs(options: argparse.Namespace) -> None:
    """Check, before minutes are spent, that the files can be written.

    Raises:
        ConfigError: a folder is missing, or a file in the way.
    """
    if options.out.exists() and not options.out.is_dir():
        raise ConfigError(f'--out: given {str(options.out)!r}, a file; allowed: a folder, new or with results')
    if options.json and (options.json.is_dir() or not options.json.parent.is_dir()):
        raise ConfigError(f'--json: given {str(options.json)!r}; allowed: a file in a folder that exists')


def _check_trials(options: argparse.Namespace) -> None:
    """Choose the most trials, where none are given.

    Raises:
        ConfigError: so few cannot show the share.
    """
    asked = Asked(options.share, options.confidence)
    fewest = fewest_trials(asked)
    if options.trials is None:
        options.trials = (looks(options.share, asked.doubt, FORGIVEN * fewest) or (fewest,))[:FORGIVEN][-1]
    if options.has_trials and options.distance is not None:
        raise ConfigError(f'--distance: given {options.distance:g}, but trials drive the tests; allowed: --no-trials')
    if options.has_trials and options.trials < fewest:
        raise ConfigError(
            f'--trials: given {options.trials}; allowed: from {fewest}, as fewer cannot show that '
            f'{100 * options.share:g} % of all trials are within the tolerance, even if none fails'
        )


def _candidates(options: argparse.Namespace) -> Campaign:
    """Load the candidates, with sets of parameters that do without a cause of errors.

    The robot's own encoder is one of them, unless candidates are given.
    """
    given = {key: getattr(options, key) for key in ('tests', 'ppr', 'encoders', 'trials', 'robot')}
    given['files'] = chosen_files(options)

    def load(values: Mapping[str, Any]) -> Campaign:
        arguments = xacro_arguments(options.robot_args)
        folder, packages = package_folder(), options.packages
        return load_campaign(options.candidates, folder, values, arguments, packages, options.has_trials)

    campaign = load(given)
    if campaign.params.vary or campaign.params.variants:
        raise ConfigError(f'--candidates: {options.candidates} varies parameters; allowed: one that varies none')
    own, candidates = campaign.robot and campaign.robot.ppr, campaign.params.ppr
    more: Dict[str, Any] = {}
    if own and not (options.ppr or campaign.params.encoders or f'{own:g}' in map(ppr_label, candidates)):
        more['ppr'] = [*(ppr.model_dump() for ppr in candidates), own]
    variants = switched_off([cell.robot_params for cell in campaign.cells])
    if variants and options.has_trials:
        more['variants'] = variants
    return load({**given, **more}) if more else campaign
