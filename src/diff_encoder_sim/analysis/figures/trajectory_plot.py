"""The true paths and those of /odom, over the map."""

from __future__ import annotations

import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D

from diff_encoder_sim.analysis.dataset import Tracks
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.figures.map_backdrop import draw_map, map_of
from diff_encoder_sim.analysis.figures.variants import Variant
from diff_encoder_sim.drives.trial_definition import Outcome, Trial

# More would hide each other.
MOST_TRIALS = 10

# The margin around the tracks, the least side of the view, and its greatest aspect ratio.
MARGIN = 0.08
LEAST_SIDE_M = 0.1
MOST_OBLONG = 3.6

WIDE_FROM = 2.0  # width to height; wider panels are stacked
ROOM = style.Room(left_in=0.7, between_in=0.12, above_in=0.22, below_in=0.22, legend_in=0.42)

_OPEN = {'markerfacecolor': 'none', 'markeredgecolor': 'black'}
START: Dict[str, Any] = {'marker': 'o', 'markersize': 6, 'markeredgewidth': 0.9, **_OPEN}
GOAL: Dict[str, Any] = {'marker': '*', 'markersize': 8, 'markeredgewidth': 0.8, **_OPEN}
FAILED: Dict[str, Any] = {'marker': 'x', 'markersize': 6, 'markeredgewidth': 1.4, 'color': '#d55e00'}
TRUE_GREY = '0.45'


class View(NamedTuple):
    """The part of the floor that is shown [m]."""

    left: float
    bottom: float
    width: float
    height: float


class _Driven(NamedTuple):
    """The path of a trial, and how it ended."""

    tracks: Tracks
    outcome: Outcome


def draw_trajectories(variant: Variant, test: str, requested: Trial) -> Optional[Drawing]:
    """Draw a panel for each encoder; None where no trial of the test has a bag."""
    shown = _shown(variant, test)
    if not shown:
        return None
    view = _view([trial.tracks for trials in shown.values() for trial in trials], requested)
    columns = _columns(view, len(shown))
    rows = math.ceil(len(shown) / columns)
    figure, panels = style.panel_grid(rows, columns, ROOM, view.height / view.width)
    colours, grid = style.ppr_colours(variant.labels), map_of(requested)
    for panel, (label, trials) in zip(panels.flat, shown.items()):
        if grid is not None:
            draw_map(panel, grid)
        _draw_panel(panel, view, [trial.tracks for trial in trials], colours[label])
        _mark(panel, requested, trials)
        panel.set_title(f'{test}, {ppr_text(label)}')
    _label_axes(panels, len(shown))
    figure.legend(handles=_legend(colours[next(iter(shown))]), loc='lower center', ncols=5)
    return figure


def _shown(variant: Variant, test: str) -> Dict[str, List[_Driven]]:
    """Return the first trials with a bag by encoder; encoders without one are left out."""
    shown = {}
    for label, trials in variant.of_test(test).items():
        driven = [_Driven(trial.tracks, trial.outcome) for trial in trials if trial.tracks is not None]
        if driven:
            shown[label] = driven[:MOST_TRIALS]
    return shown


def _view(tracks: Sequence[Tracks], requested: Trial) -> View:
    """Enclose all tracks, start and goal, with a margin."""
    ends = np.array([[pose.x_m, pose.y_m] for pose in (requested.test.start.pose(), requested.goal())])
    points = np.vstack([*(track for each in tracks for track in each), ends])
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = np.maximum(high - low, LEAST_SIDE_M) * (1.0 + 2.0 * MARGIN)
    width, height = max(width, height / MOST_OBLONG), max(height, width / MOST_OBLONG)
    centre = 0.5 * (low + high)
    return View(float(centre[0] - 0.5 * width), float(centre[1] - 0.5 * height), float(width), float(height))


def _columns(view: View, count: int) -> int:
    if view.width > WIDE_FROM * view.height:
        return 1 if count <= 4 else 2
    return min(count, 2 if count <= 4 else 4)


def _draw_panel(panel: Axes, view: View, tracks: Sequence[Tracks], colour: Any) -> None:
    for lines, line_colour, width in (
        ([track.true for track in tracks], TRUE_GREY, 1.5),
        ([track.odometry for track in tracks], colour, 0.7),
    ):
        panel.add_collection(LineCollection(lines, colors=[line_colour], linewidths=width, alpha=0.8, rasterized=True))
    panel.set(aspect='equal', xlim=(view.left, view.left + view.width), ylim=(view.bottom, view.bottom + view.height))
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(style.round_ticks(6))


def _mark(panel: Axes, requested: Trial, trials: Sequence[_Driven]) -> None:
    """Mark start, goal, and the ends of failed trials."""
    for pose, look in ((requested.test.start.pose(), START), (requested.goal(), GOAL)):
        panel.plot(pose.x_m, pose.y_m, linestyle='', zorder=4, **look)
    for trial in trials:
        if trial.outcome is not Outcome.SUCCEEDED:
            panel.plot(*trial.tracks.true[-1], linestyle='', zorder=5, **FAILED)


def _label_axes(panels: np.ndarray, used: int) -> None:
    style.hide_unused(panels, used)
    for panel in panels[-1]:
        panel.set_xlabel('x [m]')
    for panel in panels[:, 0]:
        panel.set_ylabel('y [m]')
    for panel in panels[:, 1:].flat:
        panel.tick_params(labelleft=False)


def _legend(colour: Any) -> List[Line2D]:
    return [
        Line2D([], [], color=TRUE_GREY, linewidth=1.5, label='true path'),
        Line2D([], [], color=colour, linewidth=0.9, label='/odom, coloured by encoder'),
        Line2D([], [], linestyle='', label='start', **START),
        Line2D([], [], linestyle='', label='goal', **GOAL),
        Line2D([], [], linestyle='', label='end of a failed trial', **FAILED),
    ]
