"""Figure 5: the distributions of the final errors of a pose source, by test and encoder."""

from __future__ import annotations

from typing import Any, Collection, Dict, List

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from diff_encoder_sim.analysis.encoder_labels import is_real
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.figures.variants import Variant
from diff_encoder_sim.analysis.final_errors import final_errors
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.drives.topics import PoseSource

HEIGHT_TO_WIDTH = 0.9
ROOM = style.Room(left_in=0.62, between_in=0.66, above_in=0.22, below_in=0.2, legend_in=0.42)

# Fewer values have no quartiles worth a box.
LEAST_FOR_BOX = 5
BOX_WIDTH = 0.62

# Points are spread over this width by the golden ratio: evenly, and the same way each time.
STRIP_WIDTH = 0.4
GOLDEN_RATIO = 0.618034

# From so many characters on the names of the encoders are rotated to fit, and need more room.
ROTATED_FROM, CHARACTER_IN = 16, 0.06

WITHIN_COLOUR = '0.93'


def draw_distributions(variant: Variant, source: PoseSource) -> Drawing:
    """Draw a row for each test: x, y and yaw, with a box and all points for each encoder."""
    tests = variant.tests()
    more_in = CHARACTER_IN * max(map(len, variant.labels)) if _are_rotated(variant.labels) else 0.0
    room = ROOM._replace(below_in=ROOM.below_in + more_in)
    figure, panels = style.panel_grid(len(tests), len(QUANTITIES), room, HEIGHT_TO_WIDTH)
    for row, test in zip(panels, tests):
        trials = variant.of_test(test)
        for panel, quantity in zip(row, QUANTITIES):
            values = {label: final_errors(trials.get(label, []), source, quantity) for label in variant.labels}
            _draw_panel(panel, values, quantity)
            panel.set_title(test)
    for panel in panels[-1]:
        panel.set_xlabel('encoder' if any(map(is_real, variant.labels)) else 'pulses per revolution')
    figure.legend(handles=_legend(), loc='lower center', ncols=3)
    return figure


def _draw_panel(panel: Axes, values: Dict[str, np.ndarray], quantity: Quantity) -> None:
    limit = style.shown_limit(list(values.values()), least=1.3 * quantity.tolerance)
    panel.set(xlim=(-0.6, len(values) - 0.4), ylim=(-limit, limit), ylabel=f'{quantity.axis} error [{quantity.unit}]')
    panel.axhspan(-quantity.tolerance, quantity.tolerance, color=WITHIN_COLOUR, linewidth=0, zorder=0)
    panel.axhline(0.0, color='0.7', linewidth=0.6, zorder=1)
    panel.yaxis.set_major_locator(style.round_ticks(5))
    panel.set_xticks(range(len(values)), list(values), rotation=90 if _are_rotated(values) else 0)
    for place, (label, colour) in enumerate(style.ppr_colours(list(values)).items()):
        if len(values[label]) >= LEAST_FOR_BOX:
            _draw_box(panel, values[label], place)
        _draw_strip(panel, values[label][: style.MOST_POINTS], place, limit, colour)


def _are_rotated(labels: Collection[str]) -> bool:
    return len(''.join(labels)) >= ROTATED_FROM


def _draw_box(panel: Axes, values: np.ndarray, place: int) -> None:
    line = {'color': '0.3', 'linewidth': 0.8}
    panel.boxplot(
        [values],
        positions=[place],
        widths=BOX_WIDTH,
        showfliers=False,
        manage_ticks=False,
        boxprops=line,
        whiskerprops=line,
        capprops=line,
        medianprops={'color': '0.0', 'linewidth': 1.4},
    )


def _draw_strip(panel: Axes, values: np.ndarray, place: int, limit: float, colour: Any) -> None:
    offsets = np.arange(len(values)) * GOLDEN_RATIO % 1.0 - 0.5
    places = place + STRIP_WIDTH * offsets
    is_beyond = np.abs(values) > limit
    panel.scatter(places[~is_beyond], values[~is_beyond], s=6, color=colour, alpha=0.7, linewidths=0, zorder=3)
    marked: Any = dict(s=16, color=colour, linewidths=0, zorder=4, clip_on=False)
    for sign, marker in ((1.0, '^'), (-1.0, 'v')):
        beyond = is_beyond & (np.sign(values) == sign)
        at_border = np.full(int(np.count_nonzero(beyond)), sign * limit)
        panel.scatter(places[beyond], at_border, marker=marker, **marked)


def _legend() -> List[Artist]:
    box: Any = dict(color='0.3', marker='s', markersize=7, markerfacecolor='none', linewidth=0)
    return [
        Patch(color=WITHIN_COLOUR, label='within tolerance'),
        Line2D([], [], label='quartiles and median; whiskers: 1.5 interquartile ranges', **box),
        Line2D([], [], linestyle='', marker='^', markersize=4, color='0.4', label='beyond the axes'),
    ]
