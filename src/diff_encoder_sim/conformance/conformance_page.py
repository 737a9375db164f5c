"""The verdicts of the suite as an HTML page that works offline: paths next to exact ones, errors, and all clauses."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, Sequence

import altair as alt
import numpy as np
from altair.utils.schemapi import debug_mode

from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.analysis.charts.chart_page import Chart, Choice, Option, chart_of, zoomed
from diff_encoder_sim.analysis.charts.drawings import GREY, PLAIN, equal_axes, floor_of, tips
from diff_encoder_sim.analysis.report.about import PageAbout, about_html, guide, wheels_text
from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.conformance.clauses import Evidence
from diff_encoder_sim.conformance.recording import Recording
from diff_encoder_sim.conformance.report import counts
from diff_encoder_sim.conformance.verdicts import FAIL, Verdict

MOST_POINTS = 1000  # of a path
LEAST_FLOOR_M = 0.1  # sides of the chart of a turn in place
MOST_ERROR = 1e6  # [m] or [rad]; poses beyond are not drawn
BLUE, UNITS = '#0072b2', {'position': 'mm', 'heading': '°'}  # of odometry; of errors


def write_page(evidence: Evidence, verdicts: Sequence[Verdict], command: str, path: Path) -> None:
    """Write the page of a command atomically; OSError if the file cannot be written."""
    diameter_m, separation_m = evidence.wheels.wheel_diameter, evidence.wheels.wheel_separation
    counts_text = f'{evidence.wheels.ppr:g} counts per wheel turn'
    about = PageAbout(command, wheels_text(diameter_m, diameter_m, separation_m, counts_text), [guide('conformance')])
    failed = {verdict.case: verdict.clause.number for verdict in reversed(verdicts) if verdict.outcome == FAIL}
    moving = [each for each in reversed(evidence.recordings) if each.odometry and len(each.travels_m) > 1]
    drawn = [each for each in moving if each.case.is_motion or each.name in failed]
    shown = {each.name: each for each in sorted(drawn, key=lambda each: failed.get(each.name, '9'))}
    charts = ''
    if shown:
        options = [Option(name, f'{name} (fails {failed[name]})' if name in failed else name) for name in shown]
        choices = [
            Choice('drive', 'Case', options, options[0].value, 'select', clicked_for='path'),
            Choice('error', 'Error of', [Option(name, name) for name in UNITS], 'position', 'radio'),
        ]
        with debug_mode(False):  # validation in Altair takes longer than the drawing
            charts = chart_page.charts_html(_charts(evidence, list(shown.values())), choices)
    template = chart_page.load_template('conformance.html', Path(__file__).parent, chart_page.STYLE)
    content = {'verdicts': verdicts, 'counts': counts(verdicts), 'shown': shown, 'node': evidence.mapping.about}
    write_file(path, template.render(about=about_html(about, path.parent), charts=charts, **content).encode('utf-8'))


def _charts(evidence: Evidence, recordings: Sequence[Recording]) -> List[Chart]:
    rows: List[Dict[str, Any]] = []
    cases: Dict[str, Dict[str, float]] = {}  # floor, and allowed errors
    for recording in recordings:
        of_case = _rows(recording, evidence.wheels.wheel_separation)
        points_m = np.array([[row['x'], row['y']] for row in of_case])
        least_m = points_m.mean(axis=0) + 0.5 * LEAST_FLOOR_M * np.array([[-1.0], [1.0]])
        limits = np.multiply(evidence.pose_limits(recording), (1000.0, math.degrees(1.0))).tolist()
        cases[recording.name] = {**floor_of(np.vstack((points_m, least_m))), **dict(zip(UNITS, limits))}
        rows += of_case
    axes = equal_axes({name: f'cases[drive].{name}' for name in ('x', 'y', 'width', 'height')})
    shown = {'time': 'time [s]', 'position': 'position error [mm]', 'heading': 'heading error [°]'}
    exact, found = (chart_of(rows, 'datum.drive === drive', f'datum.is_exact === {kind}') for kind in ('true', 'false'))
    line: Dict[str, Any] = {'clip': True, 'strokeJoin': 'round', 'strokeCap': 'round'}
    base = exact.mark_line(strokeWidth=6, color=GREY, opacity=0.5, **line).encode(order='order:Q', **axes)
    lines = found.mark_line(strokeWidth=1.8, color=BLUE, **line).encode(order='order:Q', tooltip=tips(shown, '.3f'))
    paths = alt.layer(base, zoomed(lines.encode(**axes))).add_params(alt.param(name='cases', value=cases))
    y = alt.Y('off:Q', title=None).axis(labelExpr=f"format(datum.value, '{PLAIN}') + ' ' + {UNITS}[error]", tickCount=6)
    errors = lines.encode(x=alt.X('time:Q', title='time [s]').scale(nice=False))
    limit = chart_of([{'drive': name, **case} for name, case in cases.items()], 'datum.drive === drive')
    limit = limit.mark_rule(color=GREY, strokeDash=[6, 4], clip=True)
    errors, limit = (chart.transform_calculate(off='datum[error]').encode(y=y) for chart in (errors, limit))
    text = 'Grey: exact arcs of the wheels; blue: odometry. Both are relative to the pose at the start.'
    return [
        Chart('path', 'Path next to the exact one', text, paths),
        Chart('error', 'Error along the case', 'Dashed: allowed at the end.', alt.layer(limit, zoomed(errors))),
    ]


def _rows(recording: Recording, separation_m: float) -> List[Dict[str, Any]]:
    """Return points of the exact path, and of the odometry with errors [mm, degrees] from the pose of its sample."""
    case, exact, found = recording.case, recording.expected(separation_m), recording.found()
    of_stamp = {sample.stamp_ns: row for sample, row in zip(recording.samples, case.rows)}
    newest = np.searchsorted(recording.sent_ns, [message.receipt_ns for message in recording.odometry]) - 1
    sent = np.clip(newest, 0, len(case.rows) - 1).tolist()  # for stamps of no sample
    rows = [of_stamp.get(each.stamp_ns, case.rows[last]) for each, last in zip(recording.odometry, sent)]
    used = sorted({*case.rows} - {case.nan_row})
    off = found - exact[np.searchsorted(used, rows, side='right') - 1]
    errors = 1000.0 * np.hypot(*off[:, :2].T), np.degrees(abs(wrap_angles(off[:, 2])))
    drawn = np.column_stack((case.times_s[rows], found[:, :2], *errors))[(abs(off) < MOST_ERROR).all(axis=1)]
    true = np.column_stack((case.times_s[used], exact[:, :2], np.zeros((len(used), 2))))
    return [
        {'drive': case.name, 'is_exact': points is true, 'order': order, **dict(zip(('time', 'x', 'y', *UNITS), row))}
        for points in (true, drawn)
        for order, row in enumerate(points[:: -(len(points) // MOST_POINTS + 1)][::-1].round(5).tolist())
    ]
