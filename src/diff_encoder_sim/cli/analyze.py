"""analyze: make tables, figures and a report from a campaign's results, from bags of trials, or of other drives.

The tables are those of the paper (final errors by test and encoder), with confidence intervals and paired comparisons
between encoders. A summary is printed; the rest is written to a folder, report.html first. Of a bag without a trial,
its odometry (or else its wheels) is compared with its reference: drive.html names the causes of the error.
"""

from __future__ import annotations

import logging
from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import AnalysisOptions
from diff_encoder_sim.base.command_line import as_called, user_errors
from diff_encoder_sim.cli.arguments import read_options

API = 'api.results'  # imported by the command on demand
EXAMPLES = ['results/paper', 'results/paper --beside results/other', 'sl.bag bags/ --out comparison', 'my_robot.bag']
parse = partial(read_options, AnalysisOptions, name='analyze', description=__doc__, examples=EXAMPLES)


@user_errors('analyze')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.results import analyze

    logging.basicConfig(format=f'{as_called("analyze")}: %(message)s')
    out, conclusions = analyze(parse(arguments), lambda text: print(text, flush=True))
    print('', *filter(None, [conclusions]), f'Report: {out}', sep='\n')
