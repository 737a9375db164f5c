"""analyze: make tables, figures and a report from a campaign's results, or from bags of trials.

The tables are those of the paper (final errors by test and encoder), with confidence intervals and paired comparisons
between encoders. A summary is printed; the rest is written to a folder, report.html first.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser


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
        'folder, or beside the first bag)',
    )
    return parser.parse_args(arguments)
