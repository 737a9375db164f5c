"""Read results of trials and write their analysis."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, Tuple, Union

from diff_encoder_sim.analysis.outputs import output_folder, write_analysis
from diff_encoder_sim.analysis.report.answer import ANALYSIS, REPORT
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.analysis.summaries import summary
from diff_encoder_sim.api.options import AnalysisOptions
from diff_encoder_sim.drives.bag_source import is_bag_folder


def read_results(*paths: Union[str, Path]) -> Results:
    """Read a campaign's results folder, or bags of trials and folders of such bags.

    Raises:
        ConfigError: there are no results.
    """
    return load_results([Path(path) for path in paths])


def write_report(results: Results, out: Union[str, Path]) -> Path:
    """Write tables, figures and the report into a folder, as `analyze` does; return the report's path.

    Raises:
        ConfigError: the folder contains other files, or cannot be written.
    """
    with output_folder(Path(out)) as folder:
        write_analysis(results, folder)
    return Path(out) / REPORT


def analyze(options: AnalysisOptions, show: Callable[[str], None]) -> Tuple[Path, str]:
    """Read results, `show` their summary, write the analysis; return the report's path, and the conclusions as text.

    ConfigError if there are no results, or the folder contains other files.
    """
    first = options.paths[0]
    folder = options.out or (first if first.is_dir() and not is_bag_folder(first) else first.parent) / ANALYSIS
    with output_folder(folder) as unfinished:
        results = load_results(options.paths)
        other = load_results([options.beside]) if options.beside else None
        show(summary(results))
        conclusions = write_analysis(results, unfinished, other)
    return folder / REPORT, conclusions
