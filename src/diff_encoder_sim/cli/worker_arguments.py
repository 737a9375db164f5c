"""Where trials run, on command lines: --workers, --scheduler and --tls-..."""

from __future__ import annotations

import argparse
from pathlib import Path

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import whole_number_within


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add the options that select where trials run."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        '--workers',
        type=whole_number_within(Between(1, 1024)),
        metavar='N',
        help='worker processes on this host (default: one for each core)',
    )
    where.add_argument(
        '--scheduler',
        metavar='ADDRESS',
        help='run on a Dask cluster: its scheduler, such as tcp://host:8786 (docs/cluster.md)',
    )
    tls = parser.add_argument_group('for a cluster whose processes know each other by certificates, in PEM files')
    tls.add_argument('--tls-ca', type=Path, metavar='FILE', help='certificate of who signed the certificates')
    tls.add_argument('--tls-cert', type=Path, metavar='FILE', help='certificate of this process')
    tls.add_argument('--tls-key', type=Path, metavar='FILE', help='its key, unless that is in the file of --tls-cert')
