"""Run campaigns on workers."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import Any, ContextManager, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.api.notes import name_campaigns_encoders, name_stopping, with_checks
from diff_encoder_sim.api.options import CampaignOptions, RunOptions
from diff_encoder_sim.base.command_line import CONSOLE, as_called
from diff_encoder_sim.base.errors import CampaignFault, ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.processes import usable_cores
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.engine import run_campaign as run_on_workers
from diff_encoder_sim.trials.executors import Workers, connected_workers, local_workers
from diff_encoder_sim.trials.progress import Progress, outcome_table
from diff_encoder_sim.trials.results import ResultStore, describe_run
from diff_encoder_sim.trials.trial_run import RunTrials, run_trials

UNRUN_SHOWN = 5


def run_campaign(out: Union[str, Path], config: Union[str, Path] = 'quick', **options: Any) -> Results:
    """Run the missing trials of a campaign and return all results.

    Args:
        out: results folder.
        config: name of a campaign, or a .yaml file.
        options: options of `campaign`, see `CampaignOptions`, and other keys of the campaign file: seed, set, ...

    Raises:
        ConfigError: an option, a file or the folder is invalid.
        CampaignFault: trials cannot be run.
    """
    own = {name: value for name, value in options.items() if name in CampaignOptions.__dataclass_fields__}
    others = {name: value for name, value in options.items() if name not in own}
    given = CampaignOptions(out=Path(out), config=str(config), others=others, **own)
    *_, unrun = complete(given, [CONSOLE, 'campaign', *_words({'config': config, 'out': out, **options})])
    if unrun:
        raise CampaignFault(unrun)
    return load_results([given.out])


def _words(options: Mapping[str, Any]) -> List[str]:
    """Return options as command-line words for the manifest, without None and False."""
    words: List[str] = []
    for name, value in options.items():
        if value is not None and value is not False:
            words.append(f'--{name.replace("_", "-")}')
            words += [] if value is True else map(str, value) if isinstance(value, (list, tuple)) else [str(value)]
    return words


def complete(
    options: CampaignOptions, command: Sequence[str], run: Optional[RunTrials] = None
) -> Tuple[Path, str, str]:
    """Run the missing trials of a campaign on workers, by `run`; `command` is written to the manifest.

    Returns the path of the table, a summary, and the trials that could not be run, with reasons ('' for none).
    ConfigError if a file, an option or the results folder is invalid; CampaignFault if trials cannot continue.
    """
    given = {**options.keys, 'files': None if options.amcl is None else {'amcl': options.amcl}}
    arguments = xacro_arguments(options.robot_args)
    campaign = load_campaign(options.config, package_folder(), given, arguments, options.packages)
    campaign = with_checks('campaign', campaign, options.unchecked)
    with ResultStore(options.out, campaign, describe_run(package_folder(), command), options.resume) as store:
        jobs = store.pending()
        if jobs:
            name_campaigns_encoders(as_called('campaign'), campaign)
            name_stopping('campaign', campaign, X.tolerance, YAW.tolerance)
        progress = Progress(sys.stderr, campaign, jobs, store.rows)
        unrun: Dict[str, List[str]] = {}
        with progress, contextlib.ExitStack() as opened:
            if jobs:
                ready = opened.enter_context(workers(options, len(jobs)))
                unrun = run_on_workers(ready, campaign, store, progress, jobs, run or run_trials)
            table = store.finish()
        duration = f'{progress.wall_time_s():.1f} s, {progress.real_time_factor():.1f} times real time'
        duration = duration if progress.done_now else 'all trials are already finished'
        return table, f'{outcome_table(store.rows)}\n{duration}', unrun_text('campaign', unrun) if unrun else ''


def workers(options: RunOptions, pending: int) -> ContextManager[Workers]:
    """Return the selected workers, at most one per pending trial; ConfigError if options contradict each other."""
    if options.workers is not None and options.scheduler is not None:
        raise ConfigError('--workers, --scheduler: given both; allowed: one of them')
    if options.scheduler is not None:
        return connected_workers(options.scheduler)
    return local_workers(min(options.workers or usable_cores(), pending))


def unrun_text(name: str, unrun: Mapping[str, Sequence[str]]) -> str:
    """Return the trials that could not be run, by reason, for the terminal."""
    lines = []
    for reason, trials in unrun.items():
        count = '1 trial' if len(trials) == 1 else f'{len(trials)} trials'
        more = ', ...' if len(trials) > UNRUN_SHOWN else ''
        lines.append(f'{as_called(name)}: {count} could not be run ({reason}): {", ".join(trials[:UNRUN_SHOWN])}{more}')
    return '\n'.join([*lines, f'{as_called(name)}: run the same command again to retry them'])
