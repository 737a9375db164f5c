"""Writes all files of an analysis, without importing what that takes before it is needed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Optional

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.base.own_folder import is_temporary, own_folder


def write_analysis(dataset: Dataset, folder: Path, beside: Optional[Dataset] = None) -> str:
    """Write tables/, figures/ and the report into a folder; return the conclusions as lines for the terminal.

    Args:
        dataset: the trials.
        folder: an existing one.
        beside: other trials, shown in the comparison with the paper alone.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read, or `beside` has no cell of the paper.
        OSError: a file cannot be written.
    """
    _give_matplotlib_a_folder()
    # matplotlib and scipy take two seconds to import, which bad arguments need not wait for.
    from diff_encoder_sim.analysis.output_files import write_files  # noqa: PLC0415

    return write_files(dataset, folder, beside)


def _give_matplotlib_a_folder() -> None:
    """Where HOME cannot be written, matplotlib would warn and list the fonts of the system each time."""
    own = own_folder()
    if own is not None and is_temporary(own):
        os.environ.setdefault('MPLCONFIGDIR', str(own / 'matplotlib'))
