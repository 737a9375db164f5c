"""conformance: judge the odometry of a recorded drive, of any node, by the clauses that a recording can show.

Compares odometry and TF in a bag with exact arcs of the recorded wheels: distance, rotation, arcs, twist, stamps,
frames, quaternions and covariance. conformance_node judges a node by all clauses (docs/conformance.md).
"""

from __future__ import annotations

import logging
import sys
from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import ConformanceOptions
from diff_encoder_sim.base.command_line import as_called, user_errors
from diff_encoder_sim.cli.arguments import read_options

EXAMPLES = [
    'drive.bag --ticks /lwheel /rwheel --ticks-per-revolution 360 --wheel-diameter 0.2 --wheel-separation 0.4',
    'drive.bag --robot kobuki --odom /odom --out results/conformance',
]

API = 'api.conformance'  # imported by the command on demand
parse = partial(read_options, ConformanceOptions, name='conformance', description=__doc__, examples=EXAMPLES)


@user_errors('conformance')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line; exit with status 1 if a clause fails."""
    from diff_encoder_sim.api.conformance import judge_drive

    logging.basicConfig(format=f'{as_called("conformance")}: %(message)s')
    done = judge_drive(parse(arguments))
    print(done.text)
    for file in done.files:
        print(file)
    if done.has_failed:
        sys.exit(1)
