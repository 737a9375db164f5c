"""Python API for notebooks and programs: campaigns and recorded drives, with results as arrays.

The functions take the command options as keyword arguments: `run_campaign('results', 'quick', ppr=[40, 90])` is
`campaign --out results --config quick --ppr 40 90`. Invalid input raises `ConfigError` with a message of one line.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diff_encoder_sim.analysis.results_table import Results
    from diff_encoder_sim.analysis.summaries import summary
    from diff_encoder_sim.api.calibration import calibrate
    from diff_encoder_sim.api.campaigns import run_campaign
    from diff_encoder_sim.api.recorded_drives import ReencodedDrive, read_path, reencode
    from diff_encoder_sim.api.results import read_results, write_report
    from diff_encoder_sim.base.errors import ConfigError
    from diff_encoder_sim.base.se2 import PoseSeries
    from diff_encoder_sim.drives.topics import PoseSource
    from diff_encoder_sim.drives.trajectory_error import PathError

_HOMES = {  # imported on first use
    'ConfigError': 'base.errors',
    'PathError': 'drives.trajectory_error',
    'PoseSeries': 'base.se2',
    'PoseSource': 'drives.topics',
    'ReencodedDrive': 'api.recorded_drives',
    'Results': 'analysis.results_table',
    'calibrate': 'api.calibration',
    'read_path': 'api.recorded_drives',
    'read_results': 'api.results',
    'reencode': 'api.recorded_drives',
    'run_campaign': 'api.campaigns',
    'summary': 'analysis.summaries',
    'write_report': 'api.results',
}

__all__ = ['ConfigError', 'PathError', 'PoseSeries', 'PoseSource', 'ReencodedDrive', 'Results', 'calibrate']
__all__ += ['read_path', 'read_results', 'reencode', 'run_campaign', 'summary', 'write_report']


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(importlib.import_module(f'diff_encoder_sim.{_HOMES[name]}'), name)
