"""The way that robots took and the way that /odom says, over the map."""
from __future__ import annotations

import math
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.errors import poses_in_map
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.figures.setups import map_of
from diff_encoder_sim.analysis.figures.variants import Variant
from diff_encoder_sim.analysis.table_keys import ppr_head
from diff_encoder_sim.experiments.definition import Trial
from diff_encoder_sim.experiments.outcome import Outcome
from diff_encoder_sim.mapping.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.reading import read_trial

# More would hide each other, and each bag takes a tenth of a second to read.
MOST_TRIALS = 10
MOST_POINTS = 600       # of a path

# Of what is shown around the paths, and how oblong that may be.
MARGIN = 0.08
LEAST_SIDE_M = 0.1
MOST_OBLONG = 3.6

WIDE_FROM = 2.0         # width to height; wider panels stand below each other
ROOM = style.Room(left_in=0.7, between_in=0.12, above_in=0.22, below_in=0.22, legend_in=0.42)

FREE_GREY, UNKNOWN_GREY, OCCUPIED_GREY = '1.0', '0.94', '0.6'


class Paths(NamedTuple):
    """Of one trial, thinned, in the map frame."""

    true: np.ndarray    # (n, 2) [m]
    odometry: np.ndarray    # (n, 2) [m]
    succeeded: bool


class View(NamedTuple):
    """What part of the floor is shown [m]."""

    left: float
    bottom: float
    width: float
    height: float


def draw_trajectories(variant: Variant, test: str, asked: Trial) -> Optional[Drawing]:
    """A panel for each encoder; None where no trial of the test has a bag.

    Raises:
        ConfigError: a bag cannot be read.
    """
    paths = {label: list(_read(trials)) for label, trials in variant.of_test(test).items()}
    paths = {label: each for label, each in paths.items() if each}
    if not paths:
        return None
    view = _view([path for each in paths.values() for path in each], asked)
    columns = _columns(view, len(paths))
    rows = math.ceil(len(paths) / columns)
    figure, panels = style.panel_grid(rows, columns, ROOM, view.height / view.width)
    colours, grid = style.ppr_colours(variant.labels), map_of(asked)
    for panel, (label, each) in zip(panels.flat, paths.items()):
        _draw_panel(panel, view, grid, each, colours[label])
        _mark(panel, asked, each)
        panel.set_title(f'{test}, {ppr_head(label)}')
    style.hide_unused(panels.flat, len(paths))
    for panel in panels[-1]:
        panel.set_xlabel('x [m]')
    for panel in panels[:, 0]:
        panel.set_ylabel('y [m]')
    for panel in panels[:, 1:].flat:
        panel.tick_params(labelleft=False)
    figure.legend(handles=_legend(colours[next(iter(paths))]), loc='lower center', ncols=5)
    return figure


def _read(trials: Sequence[TrialData]) -> Iterator[Paths]:
    for trial in [trial for trial in trials if trial.bag][:MOST_TRIALS]:
        poses = poses_in_map(read_trial(trial.bag))
        yield Paths(_thinned(poses[topics.WORLD_POSE].x_y_yaw[:, :2]),
                    _thinned(poses[topics.ODOM].x_y_yaw[:, :2]),
                    trial.outcome == Outcome.SUCCEEDED.value)


def _thinned(points: np.ndarray) -> np.ndarray:
    return points[np.unique(np.linspace(0, len(points) - 1, MOST_POINTS).round().astype(int))]


def _view(paths: Sequence[Paths], asked: Trial) -> View:
    """All paths, start and goal, with a margin."""
    ends = [[pose.x_m, pose.y_m] for pose in (asked.test.start.pose(), asked.goal())]
    points = np.vstack([*(each for path in paths for each in path[:2]), ends])
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = np.maximum(high - low, LEAST_SIDE_M) * (1.0 + 2.0 * MARGIN)
    width, height = max(width, height / MOST_OBLONG), max(height, width / MOST_OBLONG)
    centre = 0.5 * (low + high)
    return View(float(centre[0] - 0.5 * width), float(centre[1] - 0.5 * height), float(width),
                float(height))


def _columns(view: View, count: int) -> int:
    if view.width > WIDE_FROM * view.height:
        return 1 if count <= 4 else 2
    return min(count, 2 if count <= 4 else 4)


def _draw_panel(panel: Axes, view: View, grid: Optional[OccupancyGrid], paths: Sequence[Paths],
                colour: object) -> None:
    if grid is not None:
        _draw_map(panel, grid)
    for lines, line_colour, width in (([path.true for path in paths], '0.45', 1.5),
                                      ([path.odometry for path in paths], colour, 0.7)):
        panel.add_collection(LineCollection(lines, colors=[line_colour], linewidths=width,
                                            alpha=0.8, rasterized=True))
    panel.set(aspect='equal', xlim=(view.left, view.left + view.width),
              ylim=(view.bottom, view.bottom + view.height))
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(style.round_ticks(6))


def _draw_map(panel: Axes, grid: OccupancyGrid) -> None:
    shades = np.ones(grid.cells.shape)
    shades[grid.cells == UNKNOWN], shades[grid.cells == OCCUPIED] = 0.0, 2.0
    width_m, height_m = grid.width * grid.resolution_m, grid.height * grid.resolution_m
    placed = Affine2D().rotate(grid.origin.yaw_rad).translate(grid.origin.x_m, grid.origin.y_m)
    panel.imshow(shades, cmap=ListedColormap([UNKNOWN_GREY, FREE_GREY, OCCUPIED_GREY]),
                 vmin=0.0, vmax=2.0, origin='lower', interpolation='nearest',
                 extent=(0.0, width_m, 0.0, height_m), transform=placed + panel.transData)


def _mark(panel: Axes, asked: Trial, paths: Sequence[Paths]) -> None:
    """Start, goal, and where trials ended that did not succeed."""
    for pose, style_of in ((asked.test.start.pose(), START), (asked.goal(), GOAL)):
        panel.plot(pose.x_m, pose.y_m, linestyle='', zorder=4, **style_of)
    for path in paths:
        if not path.succeeded:
            panel.plot(*path.true[-1], linestyle='', zorder=5, **FAILED)


START: Dict[str, object] = {'marker': 'o', 'markersize': 6, 'markerfacecolor': 'none',
                            'markeredgecolor': 'black', 'markeredgewidth': 0.9}
GOAL: Dict[str, object] = {'marker': '*', 'markersize': 8, 'markerfacecolor': 'none',
                           'markeredgecolor': 'black', 'markeredgewidth': 0.8}
FAILED: Dict[str, object] = {'marker': 'x', 'markersize': 6, 'color': '#d55e00',
                             'markeredgewidth': 1.4}


def _legend(colour: object) -> List[Line2D]:
    return [Line2D([], [], color='0.45', linewidth=1.5, label='true path'),
            Line2D([], [], color=colour, linewidth=0.9, label='/odom, coloured by encoder'),
            Line2D([], [], linestyle='', label='start', **START),
            Line2D([], [], linestyle='', label='goal', **GOAL),
            Line2D([], [], linestyle='', label='end of a failed trial', **FAILED)]
