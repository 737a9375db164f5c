"""Write the files of an analysis into a folder atomically; only an earlier analysis is replaced."""

from __future__ import annotations

import contextlib
import os
import shutil
import uuid
from pathlib import Path
from typing import Iterator, Optional

from diff_encoder_sim.analysis.encoder_comparison import compare_encoders
from diff_encoder_sim.analysis.report.answer import REPORT, advise_command, find_answer
from diff_encoder_sim.analysis.result_tables import ResultTable, write_tables
from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.analysis.ros_wheels import ros_wheels
from diff_encoder_sim.analysis.tables import all_tables
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.wheels.ros_parameters import ros_parameters

CONTENTS = '.analysis'  # lists the files written by analyze, one per line; a folder with other files is not replaced


def write_analysis(results: Results, folder: Path, beside: Optional[Results] = None) -> str:
    """Write tables, figures, ROS parameters and the report into an existing folder; return the text for the terminal.

    Other trials `beside` are used only in the comparison with the paper. ConfigError if the paper's numbers cannot be
    read, or `beside` contains no cell of the paper; OSError if a file cannot be written.
    """
    # Importing Altair and vl-convert takes a second; check the arguments first.
    from diff_encoder_sim.analysis.charts.figures import write_figures  # noqa: PLC0415
    from diff_encoder_sim.analysis.paper.report_section import paper_section  # noqa: PLC0415
    from diff_encoder_sim.analysis.report.page import write_report  # noqa: PLC0415

    tables, compared = all_tables(results), compare_encoders(results)
    paper = paper_section([each for each in (results, beside) if each is not None])
    of_paper = [] if paper is None else [paper.scores, *paper.cells, paper.all_cells]
    comparisons = ResultTable('comparisons', '', compared.drop(columns=['p', 'setup']))
    write_tables([*tables, comparisons, *of_paper], folder / 'tables')
    lead = write_report(results, tables, compared, write_figures(results, folder / 'figures'), paper, folder / REPORT)
    command = '' if find_answer(results) else advise_command(results)
    is_concluded = paper is not None and (beside is not None or paper.has_enough_trials)
    texts = [lead.text, *(paper.texts if paper and is_concluded else [])]
    wheels = ros_wheels(results)
    if wheels:
        exported = ros_parameters(wheels)
        exported.write(folder)
        texts[:0] = [exported.ros1, '\nParameters: ros1.yaml, ros2.yaml next to the report\n']
    return '\n'.join([*texts, *([f'Which encoder: {command}'] if command else [])])


@contextlib.contextmanager
def output_folder(path: Path) -> Iterator[Path]:
    """Yield a folder that replaces `path` if there is no error; ConfigError for foreign files, or if not writable."""
    path = path.resolve()
    made = path.with_name(f'.{path.name}-{uuid.uuid4().hex[:8]}')  # links stay valid, one rename moves it
    missing = [parent for parent in made.parents if not parent.exists()]
    try:
        if path.exists() and not path.is_dir():
            raise ConfigError(f'{path}: not a folder; expected a new or empty folder')
        contents = path / CONTENTS
        known = {CONTENTS, *(contents.read_text(encoding='utf-8').split('\n') if contents.is_file() else [])}
        files = (str(file.relative_to(path)) for file in path.rglob('*'))
        foreign = next((file for file in files if file not in known), None)  # the path may be a home folder
        if foreign is not None:
            raise ConfigError(
                f'{path}: contains {foreign!r}, which analyze did not write; expected a new or empty folder, or an '
                f'earlier analysis (see --out)'
            )
        made.mkdir(parents=True)
        yield made
        names = sorted(str(file.relative_to(made)) for file in made.rglob('*'))
        (made / CONTENTS).write_text('\n'.join(names), encoding='utf-8')
        old = made.with_name(f'{made.name}-old')
        if path.exists():
            os.rename(str(path), str(old))
        os.rename(str(made), str(path))
        shutil.rmtree(str(old), ignore_errors=True)
    except OSError as error:
        raise ConfigError(f'{path}: cannot be written: {error.strerror or error}') from None
    finally:
        shutil.rmtree(str(made), ignore_errors=True)  # left only after an error
        with contextlib.suppress(OSError):  # stops at the first folder that is not empty
            for parent in missing:
                parent.rmdir()
