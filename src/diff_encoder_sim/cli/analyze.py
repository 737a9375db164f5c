"""analyze: make tables, figures and a report from a campaign's results, or from bags of trials.

The tables are those of the paper (final errors by test and encoder), with confidence intervals and paired comparisons
between encoders. A summary is printed; the rest is written to a folder, report.html first.
"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.output_folder import REPORT, output_folder
from diff_encoder_sim.analysis.outputs import write_analysis
from diff_encoder_sim.analysis.terminal_summary import summary
from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.command_name import as_called
from diff_encoder_sim.recording.bag_source import is_bag_folder

DEFAULT_NAME = 'analysis'


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    logging.basicConfig(format=f'{as_called("analyze")}: %(message)s')
    run_tool('analyze', lambda: _analyze(_parse(arguments)))


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


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    examples = ['results/paper', 'results/paper --beside results/other', 'sl.bag bags/ --out comparison']
    parser = tool_parser('analyze', __doc__, examples)
    parser.add_argument(
        'paths',
        nargs='+',
        type=Path,
        metavar='DIR|BAG',
        help="one campaign's results folder; or bags of trials, of ROS 1 or ROS 2, and folders with such bags",
    )
    parser.add_argument(
        '--beside',
        type=Path,
        metavar='DIR',
        help="another campaign's results folder: the comparison with the paper shows both, and which fits better",
    )
    parser.add_argument(
        '--out',
        type=Path,
        metavar='DIR',
        help='output folder: new, empty, or an earlier analysis, which is replaced (default: analysis/ in the given '
        'folder, or beside the first bag)',
    )
    return parser.parse_args(arguments)
