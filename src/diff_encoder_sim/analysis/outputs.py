"""Write the files of an analysis into a folder atomically; only an earlier analysis is replaced."""

from __future__ import annotations

import contextlib
import os
import shutil
import uuid
from pathlib import Path
from typing import Iterator, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.encoder_comparison import compare_encoders
from diff_encoder_sim.analysis.encoder_labels import IDEAL, ppr_text
from diff_encoder_sim.analysis.quantities import MINUS_TRUTH, QUANTITIES
from diff_encoder_sim.analysis.report.answer import REPORT, advise_command, find_answer
from diff_encoder_sim.analysis.result_tables import ResultTable, write_tables
from diff_encoder_sim.analysis.results_table import Results, encoders, final_errors
from diff_encoder_sim.analysis.summaries import Sufficiency, fewest_trials, fractions_within
from diff_encoder_sim.analysis.tables import all_tables
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, OdometryParams
from diff_encoder_sim.wheels.ros_parameters import RosWheels, ros_parameters

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
    figures, answer = write_figures(results, folder / 'figures'), find_answer(results)
    lead = write_report(results, tables, compared, figures, paper, answer, folder / REPORT)
    command = '' if answer else advise_command(results)
    is_concluded = paper is not None and (beside is not None or paper.has_enough_trials)
    texts = [lead.text, *(paper.texts if paper and is_concluded else [])]
    wheels = ros_wheels(results)
    if wheels:
        exported = ros_parameters(wheels)
        exported.write(folder)
        texts[:0] = [exported.ros1, '\nParameters: ros1.yaml, ros2.yaml next to the report\n']
    return '\n'.join([*texts, *([f'Which encoder: {command}'] if command else [])])


def ros_wheels(results: Results) -> Optional[RosWheels]:
    """Return the wheels with the coarsest encoder whose odometry suffices in all tests, else with the finest one.

    Without wheel errors of the campaign they are exact. None if no trial has an encoder.
    """
    labels, fractions = [label for label in encoders(results.trials) if label != IDEAL], fractions_within(results)
    if not labels:
        return None
    is_enough = fractions['sufficiency'] == Sufficiency.YES.value
    of_odometry = is_enough[fractions['pose'] == MINUS_TRUTH].groupby(fractions['ppr']).all()
    label = next((each for each in labels if of_odometry[each]), labels[-1])
    left, *right = map(float, label.partition(' ')[0].split('-'))  # `40-90`: 40 left, 90 right
    trial = next(iter(results.requested.values()))
    known = {key: getattr(trial, key) for key in ('wheel_diameter', 'wheel_separation', *UNCERTAINTY_KEYS)}
    odometry = OdometryParams.from_mapping({**known, 'ppr': {'left': left, 'right': [left, *right][-1]}}, '')
    about = f'{results.title}, {ppr_text(label)}, wheels as simulated'
    return RosWheels(odometry, about, measured=_measured(results, label))


def _measured(results: Results, label: str) -> Optional[Tuple[Sequence[float], str]]:
    """Return the mean squares of the odometry error after the first test with enough trials, along the axes of odom."""
    for test, of_test in results.trials[results.trials['ppr'] == label].groupby('test', sort=False):
        errors = [final_errors(of_test, MINUS_TRUTH, quantity) / quantity.scale for quantity in QUANTITIES]
        if len(errors[0]) >= fewest_trials() and results.requested[test].test.start.yaw == 0.0:
            return [float(np.mean(each**2)) for each in errors], f'{test}, measured in {len(errors[0])} trials'
    return None


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
