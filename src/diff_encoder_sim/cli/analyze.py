"""analyze: make tables, figures and a report from a campaign's results, or from bags of trials.

The tables are those of the paper (final errors by test and encoder), with confidence intervals and paired comparisons
between encoders. A summary is printed; the rest is written to a folder, report.html first.
"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import as_called, tool_parser, user_errors

API = 'api.results'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
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
        'folder, or next to the first bag)',
    )
    return parser.parse_args(arguments)


@user_errors('analyze')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.results import analyze

    logging.basicConfig(format=f'{as_called("analyze")}: %(message)s')
    options = parse(arguments)
    out, conclusions = analyze(options.paths, options.out, options.beside, lambda text: print(text, flush=True))
    print(f'\n{conclusions}\nReport: {out}')
