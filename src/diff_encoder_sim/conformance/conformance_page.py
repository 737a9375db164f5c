"""The verdicts of the suite as an HTML page that works offline: paths next to exact ones, and all clauses."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Sequence

import altair as alt
import numpy as np
from altair.utils.schemapi import debug_mode

from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.analysis.charts.chart_page import Chart, Choice, Option, chart_of, zoomed
from diff_encoder_sim.analysis.charts.drawings import GREY, equal_axes, floor_of, tips
from diff_encoder_sim.analysis.report.about import PageAbout, guide, save_page, wheels_text
from diff_encoder_sim.conformance.clauses import Evidence
from diff_encoder_sim.conformance.recording import Recording
from diff_encoder_sim.conformance.report import counts
from diff_encoder_sim.conformance.verdicts import FAIL, Verdict

MOST_POINTS = 1000  # of a path
LEAST_FLOOR_M = 0.1  # sides of the chart of a turn in place
MOST_COORDINATE_M = 1e6  # points beyond are not drawn
BLUE = '#0072b2'


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
        choice = Choice('drive', 'Case', options, options[0].value, 'select', clicked_for='path')
        with debug_mode(False):  # validation in Altair takes longer than the drawing
            chart = _path_chart(list(shown.values()), evidence.wheels.wheel_separation)
            charts = chart_page.charts_html([chart], [choice])
    content = {'verdicts': verdicts, 'counts': counts(verdicts), 'shown': shown, 'node': evidence.mapping.about}
    save_page(path, Path(__file__).with_name('conformance.html'), about, charts=charts, **content)


def _path_chart(recordings: Sequence[Recording], separation_m: float) -> Chart:
    rows: List[Dict[str, Any]] = []
    floors: Dict[str, Dict[str, float]] = {}
    for recording in recordings:
        of_case = _rows(recording, separation_m)
        points_m = np.array([[row['x'], row['y']] for row in of_case])
        least_m = points_m.mean(axis=0) + 0.5 * LEAST_FLOOR_M * np.array([[-1.0], [1.0]])
        floors[recording.name] = floor_of(np.vstack((points_m, least_m)))
        rows += of_case
    axes = equal_axes({name: f'floors[drive].{name}' for name in ('x', 'y', 'width', 'height')})
    exact, found = (chart_of(rows, 'datum.drive === drive', f'datum.is_exact === {kind}') for kind in ('true', 'false'))
    line: Dict[str, Any] = {'clip': True, 'strokeJoin': 'round', 'strokeCap': 'round'}
    base = exact.mark_line(strokeWidth=6, color=GREY, opacity=0.5, **line).encode(order='order:Q', **axes)
    shown = tips({'x': 'x [m]', 'y': 'y [m]', 'yaw': 'yaw [°]'}, '.3f')
    path = found.mark_line(strokeWidth=1.8, color=BLUE, **line).encode(order='order:Q', tooltip=shown, **axes)
    drawing = alt.layer(base, zoomed(path)).add_params(alt.param(name='floors', value=floors))
    text = 'Grey: exact arcs of the wheels; blue: odometry. Both are relative to the pose at the start.'
    return Chart('path', 'Path next to the exact one', text, drawing)


def _rows(recording: Recording, separation_m: float) -> List[Dict[str, Any]]:
    """Return points of the exact path, and of the odometry."""
    exact, found = recording.expected(separation_m), recording.found()
    drawn = found[(abs(found) < MOST_COORDINATE_M).all(axis=1)]
    return [
        {'drive': recording.name, 'is_exact': poses is exact, 'order': order, 'x': x, 'y': y, 'yaw': np.degrees(yaw)}
        for poses in (exact, drawn)
        for order, (x, y, yaw) in enumerate(poses[:: -(len(poses) // MOST_POINTS + 1)][::-1].round(5).tolist())
    ]
