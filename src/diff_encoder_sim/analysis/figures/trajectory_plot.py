"""The way that robots took and the way that /odom says, over the map."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.figures.variants import Variant
from diff_encoder_sim.analysis.table_keys import ppr_head
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.mapping.map_files import load_map
from diff_encoder_sim.mapping.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.trials.trial_definition import Trial, find_world
from diff_encoder_sim.trials.trial_outcome import Outcome

# More would hide each other.
MOST_TRIALS = 10

# Of what is shown around the tracks, and how oblong that may be.
MARGIN = 0.08
LEAST_SIDE_M = 0.1
MOST_OBLONG = 3.6

WIDE_FROM = 2.0  # width to height; wider panels stand below each other
ROOM = style.Room(left_in=0.7, between_in=0.12, above_in=0.22, below_in=0.22, legend_in=0.42)

FREE_GREY, UNKNOWN_GREY, OCCUPIED_GREY = '1.0', '0.94', '0.6'


class View(NamedTuple):
    """What part of the floor is shown [m]."""

    left: float
    bottom: float
    width: float
    height: float


def draw_trajectories(variant: Variant, test: str, asked: Trial) -> Optional[Drawing]:
    """A panel for each encoder; None where no trial of the test has a bag."""
    shown = {
        label: [trial for trial in trials if trial.tracks][:MOST_TRIALS]
        for label, trials in variant.of_test(test).items()
    }
    shown = {label: trials for label, trials in shown.items() if trials}
    if not shown:
        return None
    view = _view([trial for trials in shown.values() for trial in trials], asked)
    columns = _columns(view, len(shown))
    rows = math.ceil(len(shown) / columns)
    figure, panels = style.panel_grid(rows, columns, ROOM, view.height / view.width)
    colours, grid = style.ppr_colours(variant.labels), _map_of(asked)
    for panel, (label, trials) in zip(panels.flat, shown.items()):
        _draw_panel(panel, view, grid, trials, colours[label])
        _mark(panel, asked, trials)
        panel.set_title(f'{test}, {ppr_head(label)}')
    style.hide_unused(panels.flat, len(shown))
    for panel in panels[-1]:
        panel.set_xlabel('x [m]')
    for panel in panels[:, 0]:
        panel.set_ylabel('y [m]')
    for panel in panels[:, 1:].flat:
        panel.tick_params(labelleft=False)
    figure.legend(handles=_legend(colours[next(iter(shown))]), loc='lower center', ncols=5)
    return figure


def _map_of(asked: Trial) -> Optional[OccupancyGrid]:
    """The map beside the test's world; None where this machine has no such world, or no map."""
    try:
        world = find_world(asked.test.world, package_folder() / 'worlds')
        return load_map(world.with_suffix('.yaml'))
    except ConfigError:
        return None


def _view(trials: Sequence[TrialData], asked: Trial) -> View:
    """All tracks, start and goal, with a margin."""
    ends = [[pose.x_m, pose.y_m] for pose in (asked.test.start.pose(), asked.goal())]
    points = np.vstack([*(track for trial in trials for track in trial.tracks), ends])
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = np.maximum(high - low, LEAST_SIDE_M) * (1.0 + 2.0 * MARGIN)
    width, height = max(width, height / MOST_OBLONG), max(height, width / MOST_OBLONG)
    centre = 0.5 * (low + high)
    return View(float(centre[0] - 0.5 * width), float(centre[1] - 0.5 * height), float(width), float(height))


def _columns(view: View, count: int) -> int:
    if view.width > WIDE_FROM * view.height:
        return 1 if count <= 4 else 2
    return min(count, 2 if count <= 4 else 4)


def _draw_panel(
    panel: Axes, view: View, grid: Optional[OccupancyGrid], trials: Sequence[TrialData], colour: object
) -> None:
    if grid is not None:
        _draw_map(panel, grid)
    for lines, line_colour, width in (
        ([trial.tracks.true for trial in trials], '0.45', 1.5),
        ([trial.tracks.odometry for trial in trials], colour, 0.7),
    ):
        panel.add_collection(LineCollection(lines, colors=[line_colour], linewidths=width, alpha=0.8, rasterized=True))
    panel.set(aspect='equal', xlim=(view.left, view.left + view.width), ylim=(view.bottom, view.bottom + view.height))
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(style.round_ticks(6))


def _draw_map(panel: Axes, grid: OccupancyGrid) -> None:
    shades = np.ones(grid.cells.shape)
    shades[grid.cells == UNKNOWN], shades[grid.cells == OCCUPIED] = 0.0, 2.0
    width_m, height_m = grid.width * grid.resolution_m, grid.height * grid.resolution_m
    placed = Affine2D().rotate(grid.origin.yaw_rad).translate(grid.origin.x_m, grid.origin.y_m)
    panel.imshow(
        shades,
        cmap=ListedColormap([UNKNOWN_GREY, FREE_GREY, OCCUPIED_GREY]),
        vmin=0.0,
        vmax=2.0,
        origin='lower',
        interpolation='nearest',
        extent=(0.0, width_m, 0.0, height_m),
        transform=placed + panel.transData,
    )


def _mark(panel: Axes, asked: Trial, trials: Sequence[TrialData]) -> None:
    """Start, goal, and where trials ended that did not succeed."""
    for pose, style_of in ((asked.test.start.pose(), START), (asked.goal(), GOAL)):
        panel.plot(pose.x_m, pose.y_m, linestyle='', zorder=4, **style_of)
    for trial in trials:
        if trial.outcome is not Outcome.SUCCEEDED:
            panel.plot(*trial.tracks.true[-1], linestyle='', zorder=5, **FAILED)


START: Dict[str, object] = {
    'marker': 'o',
    'markersize': 6,
    'markerfacecolor': 'none',
    'markeredgecolor': 'black',
    'markeredgewidth': 0.9,
}
GOAL: Dict[str, object] = {
    'marker': '*',
    'markersize': 8,
    'markerfacecolor': 'none',
    'markeredgecolor': 'black',
    'markeredgewidth': 0.8,
}
FAILED: Dict[str, object] = {'marker': 'x', 'markersize': 6, 'color': '#d55e00', 'markeredgewidth': 1.4}


def _legend(colour: object) -> List[Line2D]:
    return [
        Line2D([], [], color='0.45', linewidth=1.5, label='true path'),
        Line2D([], [], color=colour, linewidth=0.9, label='/odom, coloured by encoder'),
        Line2D([], [], linestyle='', label='start', **START),
        Line2D([], [], linestyle='', label='goal', **GOAL),
        Line2D([], [], linestyle='', label='end of a failed trial', **FAILED),
    ]
