"""analyze: tables, figures and a report of results. Its help is in analyze_arguments."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.output_folder import REPORT, output_folder
from diff_encoder_sim.analysis.outputs import write_analysis
from diff_encoder_sim.analysis.terminal_summary import summary
from diff_encoder_sim.base.command_line import as_called, run_tool
from diff_encoder_sim.cli.analyze_arguments import parse
from diff_encoder_sim.drives.bag_source import is_bag_folder

DEFAULT_NAME = 'analysis'


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    logging.basicConfig(format=f'{as_called("analyze")}: %(message)s')
    run_tool('analyze', lambda: _analyze(parse(arguments)))


def _analyze(options: argparse.Namespace) -> None:
    out = options.out or _beside(options.paths[0])
    with output_folder(out) as folder:
        dataset = load_dataset(options.paths)
        beside = load_dataset([options.beside]) if options.beside else None
        print(summary(dataset), flush=True)
        conclusions = write_analysis(dataset, folder, beside)
    print(f'\n{conclusions}\nReport: {out / REPORT}')


def _beside(path: Path) -> Path:
    return (path if path.is_dir() and not is_bag_folder(path) else path.parent) / DEFAULT_NAME
