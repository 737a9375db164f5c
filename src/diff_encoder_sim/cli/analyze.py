"""analyze: tables, figures and a report of a campaign's results, or of recorded trials."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.output_folder import output_folder
from diff_encoder_sim.analysis.outputs import REPORT, write_analysis
from diff_encoder_sim.analysis.terminal_summary import summary
from diff_encoder_sim.base.console import run_tool

DEFAULT_NAME = 'analysis'


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Entry point of the executable."""
    logging.basicConfig(format='analyze: %(message)s')
    run_tool('analyze', lambda: _analyze(_parse(arguments)))


def _analyze(options: argparse.Namespace) -> None:
    out = options.out or _beside(options.paths[0])
    with output_folder(out) as folder:
        dataset = load_dataset(options.paths)
        print(summary(dataset), flush=True)
        main_line = write_analysis(dataset, folder)
    print(f'\n{out / REPORT}: {main_line}')


def _beside(path: Path) -> Path:
    return (path if path.is_dir() else path.parent) / DEFAULT_NAME


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='analyze',
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='examples:\n  analyze results/paper\n  analyze sl.bag bags/ --out comparison',
    )
    parser.add_argument(
        'paths',
        nargs='+',
        type=Path,
        metavar='DIR|BAG',
        help="a campaign's folder; or bags of trials, and folders of them",
    )
    parser.add_argument(
        '--out',
        type=Path,
        metavar='DIR',
        help='new or empty, or an earlier analysis, which it replaces (default: '
        'analysis/ in the folder, or beside the first bag)',
    )
    return parser.parse_args(arguments)
