"""The standard deviation of the errors against the encoder's resolution, beside the closed form."""

from __future__ import annotations

import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from diff_encoder_sim.analysis.closed_form import closed_form_std
from diff_encoder_sim.analysis.dataset import RobotGeometry, TrialData
from diff_encoder_sim.analysis.encoder_labels import is_real, ppr_value
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.figures.error_series import SERIES, Series
from diff_encoder_sim.analysis.figures.variants import Variant
from diff_encoder_sim.analysis.quantities import LEVEL, QUANTITIES, Quantity
from diff_encoder_sim.analysis.statistics import spread, std_interval
from diff_encoder_sim.drives.trial_definition import Trial

HEIGHT_TO_WIDTH = 0.95
ROOM = style.Room(left_in=0.7, between_in=0.72, above_in=0.22, below_in=0.22, legend_in=0.55)

# Series are shifted to be seen beside each other: by this factor of the PPR between neighbours.
APART = 1.07

# Room above and below the points; intervals of very few trials are longer and are cut off.
HEADROOM = 2.5

# Names of encoders nearer than this fraction of the axis would overlap.
NEAREST_NAMES = 1.0 / 7.0

# Axes that span more have a label at each decade only.
DECADE_NAMES_FROM = 30.0

COUNTS = FuncFormatter(lambda counts, _: f'{counts:.0f}' if counts >= 100.0 else f'{counts:g}')


class _Cell(NamedTuple):
    """The trials with one encoder."""

    ppr: float  # several real encoders may have the same
    trials: List[TrialData]
    is_real: bool


def draw_spread(variant: Variant, robot: RobotGeometry, requested: Dict[str, Trial]) -> Optional[Drawing]:
    """Draw a row for each test: x, y and yaw; None where no cell with a PPR has several trials.

    Args:
        variant: the trials.
        robot: for the closed form.
        requested: the definition of each test that has a closed form.
    """
    shown = {test: _cells(variant, test) for test in variant.tests()}
    shown = {test: cells for test, cells in shown.items() if cells}
    if not shown:
        return None
    figure, panels = style.panel_grid(len(shown), len(QUANTITIES), ROOM, HEIGHT_TO_WIDTH)
    for row, (test, cells) in zip(panels, shown.items()):
        for panel, quantity in zip(row, QUANTITIES):
            _draw_panel(panel, cells, quantity)
            if test in requested:
                _draw_closed_form(panel, requested[test], robot, [cell.ppr for cell in cells], quantity)
            panel.set_title(test)
    for panel in panels[-1]:
        panel.set_xlabel('pulses per revolution')
    _add_legend(figure, panels)
    return figure


def _add_legend(figure: Drawing, panels: np.ndarray) -> None:
    # A series without a spread is missing from some of the panels.
    lines = {label: line for panel in panels.flat for line, label in zip(*panel.get_legend_handles_labels())}
    figure.legend(list(lines.values()), list(lines), loc='lower center', ncols=3)


def _cells(variant: Variant, test: str) -> List[_Cell]:
    """Return the cells with several trials and the same encoder at both wheels, by ascending counts."""
    cells = ((ppr_value(label), trials, is_real(label)) for label, trials in variant.of_test(test).items())
    return [_Cell(ppr, trials, of_real) for ppr, trials, of_real in cells if ppr is not None and len(trials) > 1]


def _draw_panel(panel: Axes, cells: Sequence[_Cell], quantity: Quantity) -> None:
    panel.set(xscale='log', yscale='log', ylabel=f'std. dev. of {quantity.axis} [{quantity.unit}]')
    panel.grid(True)
    panel.yaxis.set_major_formatter(style.NUMBERS)
    panel.yaxis.set_minor_formatter(NullFormatter())
    stds: List[float] = []
    for place, series in enumerate(SERIES):
        shift = APART ** (place - (len(SERIES) - 1) / 2)
        for of_real in (False, True):
            of_kind = [cell for cell in cells if cell.is_real is of_real]
            stds += _draw_series(panel, series, of_kind, quantity, shift)
    if stds:
        _scale(panel, min(stds) / HEADROOM, max(stds) * HEADROOM)
    _name_pprs(panel, [cell.ppr for cell in cells])


def _draw_series(
    panel: Axes, series: Series, cells: Sequence[_Cell], quantity: Quantity, shift: float
) -> Sequence[float]:
    """Draw the standard deviations with their intervals, except zeros; return them.

    Those of real encoders are hollow and without a line: they differ by more than their counts.
    """
    points: List[Tuple[float, float, float, float]] = []
    for cell in cells:
        errors = series.errors(cell.trials, quantity)
        std = spread(errors)
        if std:
            points.append((cell.ppr * shift, std, *std_interval(errors, LEVEL)))
    if not points:
        return []
    pprs, stds, lows, highs = np.array(points).T
    look: Any = dict(markersize=3.2, linewidth=0.7, elinewidth=0.7, capsize=1.5, capthick=0.7)
    if cells[0].is_real:
        look.update(linestyle='none', markerfacecolor='white')
    bars = [stds - lows, highs - stds]
    panel.errorbar(pprs, stds, bars, color=series.colour, marker=series.marker, label=series.label, **look)
    return [std for _, std, _, _ in points]


def _draw_closed_form(
    panel: Axes, requested: Trial, robot: RobotGeometry, pprs: Sequence[float], quantity: Quantity
) -> None:
    stds = [quantity.scale * closed_form_std(requested, robot, ppr)[quantity.component] for ppr in pprs]
    look: Any = dict(color='0.45', linestyle='--', linewidth=1.1, zorder=1, markersize=9)
    marker = '_' if len(pprs) == 1 else ''
    panel.plot(pprs, stds, marker=marker, label='quantisation alone (closed form)', **look)


def _scale(panel: Axes, low: float, high: float) -> None:
    panel.set_ylim(low, high)
    named = (1.0,) if high / low > DECADE_NAMES_FROM else (1.0, 2.0, 5.0)
    panel.yaxis.set_major_locator(LogLocator(subs=named))


def _name_pprs(panel: Axes, pprs: Sequence[float]) -> None:
    """Put ticks at the encoders, as far as their names have room."""
    low, high = min(pprs) / 1.5, max(pprs) * 1.5
    named = [pprs[0]]
    for ppr in pprs[1:]:
        if math.log(ppr / named[-1]) >= NEAREST_NAMES * math.log(high / low):
            named.append(ppr)
    panel.set_xlim(low, high)
    panel.xaxis.set_major_locator(FixedLocator(named))
    panel.xaxis.set_major_formatter(COUNTS)
    panel.xaxis.set_minor_locator(NullLocator())
