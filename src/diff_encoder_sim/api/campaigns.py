"""Campaigns and their results."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Union

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.output_folder import REPORT, output_folder
from diff_encoder_sim.analysis.outputs import write_analysis
from diff_encoder_sim.api.command_options import command_line, parsed
from diff_encoder_sim.base.command_line import CONSOLE
from diff_encoder_sim.cli.campaign import complete
from diff_encoder_sim.cli.campaign_arguments import parse
from diff_encoder_sim.trials.engine import CampaignFault


def run_campaign(out: Union[str, Path], config: Union[str, Path] = 'quick', **options: Any) -> Dataset:
    """Run the trials of a campaign that its results folder does not have yet; return all results.

    Args:
        out: the results folder.
        config: a campaign by name, or a .yaml file.
        options: of the command `campaign`: tests, ppr, encoders, trials, robot, record, workers, ...

    Raises:
        ConfigError: an option, a file or the folder is bad.
        CampaignFault: trials could not be run.
    """
    words = command_line({'config': config, 'out': out, **options})
    done = complete(parsed(parse, words), [CONSOLE, 'campaign', *words])
    if done.unrun:
        raise CampaignFault(done.unrun)
    return read_results(out)


def read_results(*paths: Union[str, Path]) -> Dataset:
    """Read a campaign's results folder, or bags of trials and folders of such bags.

    Raises:
        ConfigError: there is nothing to read.
    """
    return load_dataset([Path(path) for path in paths])


def write_report(dataset: Dataset, out: Union[str, Path]) -> Path:
    """Write tables, figures and the report into a folder, as `analyze` does; return the report's path.

    Raises:
        ConfigError: the folder has other things in it, or cannot be written.
    """
    with output_folder(Path(out)) as folder:
        write_analysis(dataset, folder)
    return Path(out) / REPORT
