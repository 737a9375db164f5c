"""The choice of AMCL's parameters on command lines: --amcl."""

from __future__ import annotations

import argparse
from typing import Dict, Optional


def add_amcl(parser: argparse._ActionsContainer) -> None:
    """Add --amcl."""
    parser.add_argument(
        '--amcl',
        metavar='NAME|FILE',
        help="AMCL's parameters: amcl (the paper's) or amcl_accurate (files of config/), or a .yaml file",
    )


def chosen_files(options: argparse.Namespace) -> Optional[Dict[str, str]]:
    """Return what --amcl replaces of a campaign's `files`; None where it is not given."""
    return None if options.amcl is None else {'amcl': options.amcl}
