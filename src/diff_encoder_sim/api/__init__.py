"""What notebooks and programs import: campaigns and recorded drives, with their results as arrays.

The functions take the options of the commands by their names: `run_campaign('results', 'quick', ppr=[40, 90])` is
`campaign --out results --config quick --ppr 40 90`. A mistake raises `ConfigError`, whose text is one line.
"""

from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.analysis.terminal_summary import summary
from diff_encoder_sim.api.campaigns import read_results, run_campaign, write_report
from diff_encoder_sim.api.recorded_drives import ReencodedDrive, read_path, reencode
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trajectory_error import PathError

__all__ = [
    'ConfigError',
    'PathError',
    'PoseSeries',
    'PoseSource',
    'ReencodedDrive',
    'Results',
    'read_path',
    'read_results',
    'reencode',
    'run_campaign',
    'summary',
    'write_report',
]
