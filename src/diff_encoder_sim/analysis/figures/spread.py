"""How the spread of the errors falls with the encoder's resolution, beside what pulses explain."""

from __future__ import annotations

import math
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from diff_encoder_sim.analysis.closed_form import closed_form_std, odometry_minus_truth
from diff_encoder_sim.analysis.dataset import RobotGeometry, TrialData, ppr_value
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.figures.variants import Variant
from diff_encoder_sim.analysis.final_errors import final_errors
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.evaluation.sample_statistics import LEVEL, spread, std_interval
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_definition import Trial

HEIGHT_TO_WIDTH = 0.95
ROOM = style.Room(left_in=0.7, between_in=0.72, above_in=0.22, below_in=0.22, legend_in=0.55)

# Series stand beside each other, not on each other: a factor of the PPR between neighbours.
APART = 1.07

# Room above and below the points; intervals of very few trials reach further and are cut off.
HEADROOM = 2.5

# Names of encoders that are nearer than this share of the axis would run into each other.
NEAREST_NAMES = 1.0 / 7.0

# Axes that span more have a name at each decade only.
DECADE_NAMES_FROM = 30.0

# Plain, also where a log axis would have powers of ten.
NUMBERS = FuncFormatter(lambda number, _: f'{number:g}')


class Series(NamedTuple):
    """One line of the figure."""

    label: str
    colour: str  # of Okabe and Ito's palette, which the colour-blind can tell
    marker: str
    values: Callable[[Sequence[TrialData], Quantity], np.ndarray]  # of a cell


def _of(source: PoseSource) -> Callable[[Sequence[TrialData], Quantity], np.ndarray]:
    return lambda trials, quantity: final_errors(trials, source, quantity)


SERIES = (
    Series('/odom minus /world_pose', '#0072b2', 'o', odometry_minus_truth),
    Series('/odom minus goal', '#56b4e9', 's', _of(PoseSource.ODOM)),
    Series('/world_pose minus goal', '#000000', 'D', _of(PoseSource.WORLD)),
    Series('/global_pose minus goal', '#d55e00', '^', _of(PoseSource.GLOBAL)),
    Series('/amcl_pose minus goal', '#e69f00', 'v', _of(PoseSource.AMCL)),
)


def draw_spread(variant: Variant, robot: RobotGeometry, asked: Dict[str, Trial]) -> Optional[Drawing]:
    """A row for each test: x, y and yaw; None where no cell has a spread over a known PPR.

    Args:
        asked: a trial of each test that has a closed form.
    """
    cells = {test: _by_ppr(variant, test) for test in variant.tests()}
    cells = {test: by_ppr for test, by_ppr in cells.items() if by_ppr}
    if not cells:
        return None
    figure, panels = style.panel_grid(len(cells), len(QUANTITIES), ROOM, HEIGHT_TO_WIDTH)
    for row, (test, by_ppr) in zip(panels, cells.items()):
        for panel, quantity in zip(row, QUANTITIES):
            _draw_panel(panel, by_ppr, quantity)
            if test in asked:
                _draw_closed_form(panel, asked[test], robot, list(by_ppr), quantity)
            panel.set_title(test)
    for panel in panels[-1]:
        panel.set_xlabel('pulses per revolution')
    # A series without a spread is missing from some of the panels.
    lines = {label: line for panel in panels.flat for line, label in zip(*panel.get_legend_handles_labels())}
    figure.legend(list(lines.values()), list(lines), loc='lower center', ncols=3)
    return figure


def _by_ppr(variant: Variant, test: str) -> Dict[float, List[TrialData]]:
    """Cells of several trials with an encoder whose wheels are alike."""
    return {
        ppr_value(label): trials
        for label, trials in variant.of_test(test).items()
        if ppr_value(label) is not None and len(trials) > 1
    }


def _draw_panel(panel: Axes, by_ppr: Dict[float, List[TrialData]], quantity: Quantity) -> None:
    panel.set(xscale='log', yscale='log', ylabel=f'std. dev. of {quantity.axis} [{quantity.unit}]')
    panel.grid(True)
    panel.yaxis.set_major_formatter(NUMBERS)
    panel.yaxis.set_minor_formatter(NullFormatter())
    spreads: List[float] = []
    for place, series in enumerate(SERIES):
        shift = APART ** (place - (len(SERIES) - 1) / 2)
        spreads += _draw_series(panel, series, by_ppr, quantity, shift)
    if spreads:
        _scale_spreads(panel, min(spreads) / HEADROOM, max(spreads) * HEADROOM)
    _name_pprs(panel, list(by_ppr))


def _draw_series(
    panel: Axes, series: Series, by_ppr: Dict[float, List[TrialData]], quantity: Quantity, shift: float
) -> List[float]:
    """Draw the spreads with their intervals, but for those of zero; returns them."""
    points: List[Tuple[float, float, float, float]] = []
    for ppr, trials in by_ppr.items():
        values = series.values(trials, quantity)
        std = spread(values)
        if std:
            points.append((ppr * shift, std, *std_interval(values, LEVEL)))
    if not points:
        return []
    pprs, stds, lows, highs = np.array(points).T
    panel.errorbar(
        pprs,
        stds,
        [stds - lows, highs - stds],
        color=series.colour,
        marker=series.marker,
        markersize=3.2,
        linewidth=0.7,
        elinewidth=0.7,
        capsize=1.5,
        capthick=0.7,
        label=series.label,
    )
    return stds.tolist()


def _draw_closed_form(
    panel: Axes, asked: Trial, robot: RobotGeometry, pprs: Sequence[float], quantity: Quantity
) -> None:
    stds = [quantity.scale * closed_form_std(asked, robot, ppr)[quantity.component] for ppr in pprs]
    panel.plot(
        pprs,
        stds,
        color='0.45',
        linestyle='--',
        linewidth=1.1,
        zorder=1,
        marker='_' if len(pprs) == 1 else '',
        markersize=9,
        label='whole pulses alone (closed form)',
    )


def _scale_spreads(panel: Axes, low: float, high: float) -> None:
    panel.set_ylim(low, high)
    named = (1.0,) if high / low > DECADE_NAMES_FROM else (1.0, 2.0, 5.0)
    panel.yaxis.set_major_locator(LogLocator(subs=named))


def _name_pprs(panel: Axes, pprs: Sequence[float]) -> None:
    """Ticks at the encoders that there are, as far as their names have room."""
    low, high = min(pprs) / 1.5, max(pprs) * 1.5
    named = [pprs[0]]
    for ppr in pprs[1:]:
        if math.log(ppr / named[-1]) >= NEAREST_NAMES * math.log(high / low):
            named.append(ppr)
    panel.set_xlim(low, high)
    panel.xaxis.set_major_locator(FixedLocator(named))
    panel.xaxis.set_major_formatter(NUMBERS)
    panel.xaxis.set_minor_locator(NullLocator())
