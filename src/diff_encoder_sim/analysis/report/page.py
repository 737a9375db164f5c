"""Content of the report, and the page rendered from it: results, and their origin from the manifest of a campaign."""

from __future__ import annotations

import base64
import platform
import shlex
import urllib.parse
from importlib.metadata import version
from pathlib import Path
from typing import List, Optional, Sequence

import numpy as np
import yaml
from altair.utils.schemapi import debug_mode

from diff_encoder_sim.analysis import summaries
from diff_encoder_sim.analysis.charts.figures import Figure
from diff_encoder_sim.analysis.charts.frames import with_paths
from diff_encoder_sim.analysis.charts.trial_charts import trial_charts
from diff_encoder_sim.analysis.closed_form import closed_form_table
from diff_encoder_sim.analysis.encoder_comparison import difference_table, differences
from diff_encoder_sim.analysis.encoder_labels import encoders_text, enumeration, ppr_text
from diff_encoder_sim.analysis.paper.report_section import PaperSection
from diff_encoder_sim.analysis.quantities import POSES, REQUIRED_FRACTION
from diff_encoder_sim.analysis.report.about import Link, PageAbout, guide, href, robot_file, save_page, wheels_text
from diff_encoder_sim.analysis.report.answer import FoundAnswer, advise_command
from diff_encoder_sim.analysis.result_tables import Column, ResultTable, html_table
from diff_encoder_sim.analysis.results_table import SUCCEEDED, Results, encoders, first_of_cells, sample_text
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE
from diff_encoder_sim.analysis.summaries import COMPARED_POSES, TOLERANCE_TEXT
from diff_encoder_sim.analysis.tables import VARIANTS, first_variant
from diff_encoder_sim.base.command_line import CONSOLE
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.trials_csv import VARIANT

LIBRARIES = ('numpy', 'pandas', 'scipy', 'altair', 'vl-convert-python')  # of the analysis


def write_report(
    results: Results,
    tables: Sequence[ResultTable],
    compared: pd.DataFrame,
    figures: Sequence[Figure],
    paper: Optional[PaperSection],
    answer: Optional[FoundAnswer],
    path: Path,
) -> summaries.Headline:
    """Write the report of `all_tables`, `compare_encoders`, `write_figures`, `paper_section` and `find_answer`.

    OSError if it cannot be written.
    """
    fractions, shown = summaries.fractions_within(results), first_of_cells(results.trials).reset_index(drop=True)
    lead, different = summaries.headline(fractions, results.trials), differences(compared)
    variants = next((table for table in tables if table.name == VARIANTS), None)
    embedded = {one.name: {'caption': one.caption, 'uri': data_uri(one.svg, one.png)} for one in figures}
    failed = results.trials[results.trials['outcome'] != SUCCEEDED]
    of_first = results.trials['setup'][results.trials[VARIANT] == first_variant(results.trials)] if variants else []
    is_few = fractions.groupby('setup')['trials'].transform('max') < summaries.fewest_trials()
    is_main = fractions['setup'].isin(of_first) | (variants is None)
    with debug_mode(False):  # validation in Altair takes longer than the drawing
        charts = trial_charts(results, shown)
    save_page(
        path,
        Path(__file__).with_name('page.html'),
        page_about(results, answer),
        answer=answer,
        answer_page=answer and href(answer.page, path.parent),
        advise_command=advise_command(results),
        fewest=summaries.fewest_trials(),
        results=results,
        manifest=results.manifest,
        headline=lead,
        tests=enumeration(list(results.trials['test'].unique())),
        encoders=encoders_text(encoders(results.trials)),
        cell_sizes=list(results.trials['cell'].value_counts()),
        ppr_text=ppr_text,
        shell=lambda command: shlex.join(map(str, command)),
        commands=commands(results),
        own_versions={'python': platform.python_version(), **dict(zip(LIBRARIES, map(version, LIBRARIES)))},
        yaml_text=lambda configuration: yaml.safe_dump(configuration, sort_keys=False),
        tolerance=TOLERANCE_TEXT,
        required_percent=round(100 * REQUIRED_FRACTION),
        compared_poses={text: POSES[pose] for pose, text in COMPARED_POSES.items()},
        fractions=fractions[is_main & ~is_few],
        of_few=fractions[is_main & is_few],
        of_variants=fractions[~is_main],
        paper=paper,
        paper_claims=list(zip(*paper.claims.values())) if paper else [],  # results of each campaign
        html_table=html_table,
        variants=variants,
        variants_figure=embedded.pop(VARIANTS, None),
        figures=list(embedded.values()),
        goal_tables=[table for table in tables if not table.name.endswith(('_intervals', VARIANTS))],
        interval_tables=[table for table in tables if table.name.endswith('_intervals')],
        comparisons=len(compared),
        different=different.groupby('setup', sort=False),
        difference_table=difference_table(different),
        significance=SIGNIFICANCE,
        closed_form=closed_form_table(results),
        failures=failure_table(failed) if len(failed) else None,
        trials_shown=sample_text(shown, results.trials) or f'All {len(results.trials)} trials',
        trials=trial_table(results, shown),
        bags=[bag and {'name': Path(bag).name, 'href': href(Path(bag), path.parent)} for bag in shown['bag']],
        with_path=list(with_paths(shown).index),
        charts=charts,
    )
    return lead


def page_about(results: Results, answer: Optional[FoundAnswer]) -> PageAbout:
    """Return origin and links of the report."""
    diameter_m, separation_m = results.robot
    links = [Link('Which encoder: the advice', answer.page)] if answer else []
    links += [*robot_file(results.manifest.get('robot', {}).get('file', '')), *map(guide, ('campaigns', 'index'))]
    tests = [each.test for each in results.requested.values()]
    return PageAbout('analyze', wheels_text(diameter_m, diameter_m, separation_m), links, tests)


def trial_table(results: Results, trials: pd.DataFrame) -> ResultTable:
    """Build the table of trials: outcome, final error of each source, and ATE of odometry."""
    exact = trials[['test', *results.varied, 'ppr', 'trial', 'outcome', 'duration_s', 'distance_m']]
    exact = exact.assign(outcome=exact['outcome'].str.replace('_', ' '))
    columns = {'trial': Column('trial', decimals=0), 'duration_s': Column('time [s]', decimals=1)}
    columns['distance_m'] = Column('path [m]', decimals=2)
    for source, topic in TOPIC_OF_SOURCE.items():
        metres, degrees = f'{source.value}_m', f'{source.value}_deg'
        exact[metres] = np.hypot(trials[f'{source.value}_x_m'], trials[f'{source.value}_y_m'])
        exact[degrees] = np.degrees(trials[f'{source.value}_yaw_rad'])
        columns.update({metres: Column(f'{topic} [m]', decimals=4), degrees: Column(f'{topic} [deg]', decimals=2)})
    exact['odom_ate_m'], columns['odom_ate_m'] = trials['odom_ate_rmse_m'], Column('/odom ATE [m]', decimals=4)
    return ResultTable('trials', 'All trials', exact, columns)


def failure_table(failed: pd.DataFrame) -> ResultTable:
    """Build the table of failed trials with their reasons; limited by `first_of_cells`."""
    shown = first_of_cells(failed)
    exact = shown[['cell', 'trial', 'outcome', 'reason']].replace({'outcome': {'timed_out': 'timed out'}})
    notes = [f'{text}.' for text in [sample_text(shown, failed)] if text]
    return ResultTable('failures', 'Trials that did not succeed', exact, {'trial': Column('trial', decimals=0)}, notes)


UNQUOTED = " !'()*+,-./:;=?@[]^_`{|}~\n"  # need no escape in a quoted attribute; SVG as text is smaller than base64


def data_uri(svg: Path, png: Path) -> str:
    """Return the smaller of SVG and PNG as a data URI."""
    pixels = 'data:image/png;base64,' + base64.b64encode(png.read_bytes()).decode('ascii')
    drawn = 'data:image/svg+xml,' + urllib.parse.quote(svg.read_text(encoding='utf-8'), safe=UNQUOTED)
    return min(drawn, pixels, key=len)


def commands(results: Results) -> List[str]:
    """Return the commands that reproduce the results; none for bags."""
    runs = results.manifest.get('runs')
    if not results.folder or not runs:
        return []
    program, *arguments = map(str, runs[0].get('command') or [''])
    tool = [CONSOLE] if Path(program).name == CONSOLE else ['rosrun', 'diff_encoder_sim', 'campaign']
    return [shlex.join([*tool, *arguments]), shlex.join([*tool[:2], 'analyze', str(results.folder)])]
