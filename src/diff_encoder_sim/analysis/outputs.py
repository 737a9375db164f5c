"""Writes all files of an analysis, without importing what that takes before it is needed."""

from __future__ import annotations

from pathlib import Path

from diff_encoder_sim.analysis.dataset import Dataset


def write_analysis(dataset: Dataset, folder: Path) -> str:
    """Write tables/, figures/ and the report into a folder; return the report's headline.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
        OSError: a file cannot be written.
    """
    # matplotlib and scipy take two seconds to import, which bad arguments need not wait for.
    from diff_encoder_sim.analysis.output_files import write_files  # noqa: PLC0415

    return write_files(dataset, folder).text
