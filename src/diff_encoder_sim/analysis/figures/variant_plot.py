"""The odometry's own final error in each variant of a campaign, by encoder."""

from __future__ import annotations

import textwrap
from typing import Any, Dict, List, Optional, Tuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, distinct
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.figures import style
from diff_encoder_sim.analysis.table_keys import setup_text
from diff_encoder_sim.analysis.variant_errors import KINDS, VariantError, first_variant, variant_errors
from diff_encoder_sim.trials.trials_csv import VARIANT

ROOM = style.Room(left_in=1.75, between_in=0.2, above_in=0.22, below_in=0.25, legend_in=0.6)
PANEL_IN = (style.WIDTH_IN - ROOM.left_in - style.RIGHT_IN - ROOM.between_in) / len(KINDS)

# Of a row with the points of so many encoders, which are beside each other over this part of it.
ROW_IN, BESIDE = 0.27, 0.7
MOST_LETTERS = 30  # of a name in one line: two of them fit into a row
LEGEND_COLUMNS = 4

_Errors = Dict[CellKey, VariantError]


def draw_variants(dataset: Dataset) -> Optional[Drawing]:
    """Draw a row for each test, with the other varied parameters: position and heading; None without variants."""
    errors = [variant_errors(dataset, kind) for kind in KINDS]
    if not any(errors):
        return None
    names = distinct(dict(cell.varied)[VARIANT] for cell in dataset.cells())
    setups = distinct((cell.test, _others(cell)) for cell in dataset.cells())
    figure, panels = style.panel_grid(len(setups), len(KINDS), ROOM, ROW_IN * len(names) / PANEL_IN)
    for row, (test, others) in zip(panels, setups):
        for panel, kind, of_kind in zip(row, KINDS, errors):
            shown = {cell: one for cell, one in of_kind.items() if (cell.test, _others(cell)) == (test, others)}
            _draw_panel(panel, shown, names, dataset)
            panel.set_title(f'{setup_text(test, others)}: {kind.head}')
        row[0].set_yticks(range(len(names)), [textwrap.fill(name, MOST_LETTERS) for name in names])
        row[1].set_yticks(range(len(names)), [''] * len(names))
    figure.legend(handles=_legend(dataset), loc='lower center', ncols=LEGEND_COLUMNS)
    return figure


def _others(cell: CellKey) -> Tuple[Tuple[str, str], ...]:
    return tuple((key, value) for key, value in cell.varied if key != VARIANT)


def _draw_panel(panel: Axes, errors: _Errors, names: List[str], dataset: Dataset) -> None:
    labels = dataset.encoders()
    first, colours = first_variant(dataset.cells()), style.ppr_colours(labels)
    panel.set(xscale='log', ylim=(len(names) - 0.5, -0.5))
    panel.grid(True, axis='x')
    for cell, error in errors.items():
        name, colour = dict(cell.varied)[VARIANT], colours[cell.ppr]
        if error.median <= 0.0:
            continue  # it has no place on a logarithmic axis
        place = names.index(name) + BESIDE * ((labels.index(cell.ppr) + 0.5) / len(labels) - 0.5)
        bars = [[error.median - error.low], [error.high - error.median]]
        panel.errorbar([error.median], [place], xerr=bars, color=colour, **_look(error.failed > 0))
        if name == first:
            panel.plot([error.median] * 2, [-0.5, len(names) - 0.5], color=colour, linewidth=0.7, linestyle=':')


def _look(has_failed: bool) -> Dict[str, Any]:
    filled = {'markerfacecolor': 'white'} if has_failed else {}
    return dict(marker='o', markersize=3.2, linestyle='none', elinewidth=0.8, **filled)


def _legend(dataset: Dataset) -> List[Line2D]:
    look: Dict[str, Any] = dict(marker='o', markersize=4, linestyle='none')
    colours = style.ppr_colours(dataset.encoders())
    return [
        *(Line2D([], [], color=colour, label=ppr_text(label), **look) for label, colour in colours.items()),
        Line2D([], [], color='0.4', markerfacecolor='white', label='some trials failed', **look),
        Line2D([], [], color='0.4', linewidth=0.8, linestyle=':', label=first_variant(dataset.cells())),
    ]
