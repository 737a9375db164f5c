"""Figure 4: the final position errors of a pose source, about the goal."""

from __future__ import annotations

import math
from typing import Any, List, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.encoder_labels import is_real, ppr_text
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.figures.variants import Variant
from diff_encoder_sim.analysis.final_errors import final_errors
from diff_encoder_sim.analysis.quantities import X, Y
from diff_encoder_sim.drives.topics import PoseSource

MOST_ABREAST = 5
LEAST_ABREAST = 3  # fewer panels are as wide as those of three
# Labels below the outer ticks of neighbouring panels need room between them.
ROOM = style.Room(left_in=0.75, between_in=0.28, above_in=0.34, below_in=0.22, legend_in=0.42)
LINE_IN = 0.13  # that names of real encoders need above a panel, in addition
BEYOND_MARKER = 'X'


def draw_xy_errors(variant: Variant, source: PoseSource) -> Drawing:
    """Draw a row of panels for each test, or several where there are many encoders.

    The rows of a test have one scale, so that spreads can be compared by eye.
    """
    tests, columns = variant.tests(), _abreast(len(variant.labels))
    rows_per_test = math.ceil(len(variant.labels) / columns)
    rows = rows_per_test * len(tests)
    more_in = LINE_IN if any(map(is_real, variant.labels)) else 0.0
    room = ROOM._replace(above_in=ROOM.above_in + more_in)
    figure, panels = style.panel_grid(rows, columns, room, least_columns=LEAST_ABREAST)
    for index, test in enumerate(tests):
        _draw_test(variant, test, source, panels[index * rows_per_test : (index + 1) * rows_per_test])
    for panel in panels[-1]:
        panel.set_xlabel('x error [m]')
    figure.legend(handles=_legend(), loc='lower center', ncols=2)
    return figure


def _abreast(count: int) -> int:
    """Return the number of columns that fills the rows evenly."""
    return math.ceil(count / math.ceil(count / MOST_ABREAST))


def _draw_test(variant: Variant, test: str, source: PoseSource, panels: np.ndarray) -> None:
    trials, colours = variant.of_test(test), style.ppr_colours(variant.labels)
    points = [_points(trials.get(label, []), source) for label in variant.labels]
    limit_m = style.shown_limit([values for each in points for values in each.T], least=1.2 * X.tolerance)
    for panel, label, of_label in zip(panels.flat, variant.labels, points):
        _draw_panel(panel, of_label[: style.MOST_POINTS], limit_m, colours[label])
        panel.set_title(f'{_name(label)}\n{_counts(of_label, limit_m)}')
    style.hide_unused(panels, len(variant.labels))
    for row in panels:
        row[0].set_ylabel(f'{test}\ny error [m]')
        for panel in row[1:]:
            panel.tick_params(labelleft=False)


def _name(label: str) -> str:
    """Return an encoder in lines that fit above a panel."""
    return ppr_text(label).replace(' (', '\n(')


def _points(trials: Sequence[TrialData], source: PoseSource) -> np.ndarray:
    """(n, 2) errors [m]."""
    return np.column_stack([final_errors(trials, source, axis) for axis in (X, Y)])


def _draw_panel(panel: Axes, points: np.ndarray, limit_m: float, colour: Any) -> None:
    panel.set(xlim=(-limit_m, limit_m), ylim=(-limit_m, limit_m), aspect='equal')
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(style.round_ticks(3))
        axis.set_major_formatter(style.NUMBERS)
    panel.grid(True)
    panel.add_patch(
        Circle((0.0, 0.0), X.tolerance, fill=False, linewidth=0.9, edgecolor=style.TOLERANCE_COLOUR, zorder=5)
    )
    is_beyond = _is_beyond(points, limit_m)
    inside, beyond = points[~is_beyond], points[is_beyond].clip(-limit_m, limit_m)
    panel.scatter(inside[:, 0], inside[:, 1], s=11, color=colour, alpha=0.75, linewidths=0, zorder=3)
    marked: Any = dict(s=22, marker=BEYOND_MARKER, color=colour, linewidths=0, zorder=4, clip_on=False)
    panel.scatter(beyond[:, 0], beyond[:, 1], **marked)


def _is_beyond(points: np.ndarray, limit_m: float) -> np.ndarray:
    is_beyond: np.ndarray = (np.abs(points) > limit_m).any(axis=1)
    return is_beyond


def _counts(points: np.ndarray, limit_m: float) -> str:
    """Count the points within the circle and beyond the axes."""
    inside = int(np.count_nonzero(np.hypot(*points.T) <= X.tolerance))
    beyond = int(np.count_nonzero(_is_beyond(points, limit_m)))
    return f'{inside} of {len(points)} inside' + (f', {beyond} beyond' if beyond else '')


def _legend() -> List[Line2D]:
    circle: Any = dict(marker='o', markersize=7, markerfacecolor='none', markeredgecolor=style.TOLERANCE_COLOUR)
    beyond: Any = dict(marker=BEYOND_MARKER, markersize=5, color='0.4')
    return [
        Line2D([], [], linestyle='', label=f'{X.tolerance:g} m from the goal', **circle),
        Line2D([], [], linestyle='', label='beyond the axes, drawn at their border', **beyond),
    ]
