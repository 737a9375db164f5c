"""Read results of trials and write their analysis."""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path
from typing import Callable, List, Sequence, Tuple, Union

from diff_encoder_sim.analysis.outputs import output_folder, write_analysis
from diff_encoder_sim.analysis.report.answer import ANALYSIS, REPORT
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.analysis.summaries import summary
from diff_encoder_sim.api.options import AnalysisOptions, DriveOptions
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import bags_in, is_bag_folder, open_source
from diff_encoder_sim.drives.recorded_poses import find_poses
from diff_encoder_sim.drives.topics import ARROW, ODOM, ODOMETRY_TYPE, POSE_STAMPED_TYPE, TRIAL

log = logging.getLogger(__name__)
DRIVE_PAGE, KINDS = 'drive.html', (ODOMETRY_TYPE, POSE_STAMPED_TYPE)


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

    Of bags without a trial, the report is the page of the drive. ConfigError if there are no results, or the folder
    contains other files.
    """
    first, drives = options.paths[0], _drives(options.paths)
    folder = options.out or (first if first.is_dir() and not is_bag_folder(first) else first.parent) / ANALYSIS
    with output_folder(folder) as unfinished:
        pages = [DRIVE_PAGE] if len(drives) == 1 else [f'{path.stem}.html' for path in drives]
        for path, page in zip(drives, pages):
            show(_compared(path, unfinished / page))
        if drives:
            return folder / pages[0], ''
        results = load_results(options.paths)
        other = load_results([options.beside]) if options.beside else None
        show(summary(results))
        conclusions = write_analysis(results, unfinished, other)
    return folder / REPORT, conclusions


def _drives(paths: Sequence[Path]) -> List[Path]:
    """Return the bags if none of them is of a trial; else nothing."""
    bags = [bag for path in paths for bag in (bags_in(path) if path.is_dir() else [path])]
    try:
        return [] if any(TRIAL in open_source(bag).topics for bag in bags) else bags
    except ConfigError:  # which reading the trials reports
        return []


def _compared(path: Path, page: Path) -> str:
    """Write the page of a drive by its odometry, else by its wheels; return the report."""
    from diff_encoder_sim.api.recorded_drives import reencoding  # noqa: PLC0415 - most analyses need no wheels

    source, frames = open_source(path), [f'map{ARROW}base_link', f'map{ARROW}base_footprint']
    odoms, poses = ([topic for topic in sorted(source.topics) if source.topics[topic] == kind] for kind in KINDS)
    reference = next((topic for topic in poses if 'goal' not in topic), '')
    while frames and not reference:
        with contextlib.suppress(ConfigError):
            reference = find_poses(source, '--reference', frames.pop(0)).name
    odom = ODOM if ODOM in odoms else ''.join(odoms[:1])
    try:
        done = reencoding(DriveOptions(bag=path, odom=odom, reference=reference, page=page), 'analyze')
    except ConfigError as error:
        raise ConfigError(f'{error} (no trial: its wheels and reference are options of reencode)') from None
    for note in done.notes:
        log.warning('%s', note)
    return done.text
