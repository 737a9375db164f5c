"""The common look of all figures, and how they are saved: for a report 16 cm wide, in colour or grey."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import FuncFormatter, MaxNLocator

WIDTH_IN = 16.0 / 2.54
RIGHT_IN = 0.1
PNG_DPI = 150
SVG_DPI = 300  # of what is too dense for vectors

STYLE: Dict[Any, Any] = {
    'font.family': 'sans-serif',
    'font.sans-serif': ['DejaVu Sans'],
    'font.size': 8.0,
    'axes.titlesize': 7.5,
    'axes.labelsize': 7.5,
    'xtick.labelsize': 7.0,
    'ytick.labelsize': 7.0,
    'legend.fontsize': 7.0,
    'legend.frameon': False,
    'axes.linewidth': 0.6,
    'axes.edgecolor': '0.4',
    'xtick.color': '0.25',
    'ytick.color': '0.25',
    'axes.axisbelow': True,
    'grid.color': '0.9',
    'grid.linewidth': 0.5,
    'xtick.major.width': 0.6,
    'ytick.major.width': 0.6,
    'figure.dpi': PNG_DPI,
    # Text that a browser can search, and the same bytes for the same data.
    'svg.fonttype': 'none',
    'svg.hashsalt': 'diff_encoder_sim',
}

# Plain and short: 0.05 and 0, where matplotlib writes 0.00, and powers of ten on logarithmic axes.
NUMBERS = FuncFormatter(lambda number, _: f'{number:g}'.replace('-', '−'))

TOLERANCE_COLOUR = '0.35'

# Where in viridis, which runs from dark to light and stays distinguishable in grey, coarse encoders
# begin and fine ones end; its yellow end is too pale for points on white.
COARSEST, FINEST = 0.80, 0.0

# Axes show all values up to so many times the median of any cell, and the rest at their border.
MEDIAN_TIMES = 6.0

# Points of more trials hide each other: the first of a cell are drawn.
MOST_POINTS = 1000


class Room(NamedTuple):
    """The room that panels leave for texts [in]."""

    left_in: float  # of the first column
    between_in: float  # columns
    above_in: float  # each row
    below_in: float  # each row
    legend_in: float  # at the foot, with the names of the last row's axes


class Figure(NamedTuple):
    """A figure that was written."""

    name: str
    caption: str
    png: Path
    svg: Path


def ppr_colours(labels: Sequence[str]) -> Dict[str, Any]:
    """Assign a colour to each encoder, light to dark in the order given."""
    places = np.linspace(COARSEST, FINEST, len(labels)) if len(labels) > 1 else [FINEST]
    return dict(zip(labels, matplotlib.colormaps['viridis'](places)))


def panel_grid(
    rows: int, columns: int, room: Room, height_to_width: float = 1.0, least_columns: int = 1
) -> Tuple[Drawing, np.ndarray]:
    """Make a figure of the report's width with equal panels; return it and its (rows, columns) axes.

    Args:
        rows: of panels.
        columns: of panels.
        room: for texts; given, because matplotlib's own layout takes longer than the drawing.
        height_to_width: of a panel.
        least_columns: fewer columns are as wide as these.
    """
    places = max(columns, least_columns)
    width_in = (WIDTH_IN - room.left_in - RIGHT_IN - (places - 1) * room.between_in) / places
    panel_in = height_to_width * width_in
    row_in = room.above_in + panel_in + room.below_in
    height_in = rows * row_in + room.legend_in
    figure = Drawing(figsize=(WIDTH_IN, height_in))
    first_in = room.left_in + 0.5 * (places - columns) * (width_in + room.between_in)
    axes = np.empty((rows, columns), dtype=object)
    for row, column in np.ndindex(rows, columns):
        left_in = first_in + column * (width_in + room.between_in)
        bottom_in = height_in - (row + 1) * row_in + room.below_in
        axes[row, column] = figure.add_axes(
            (left_in / WIDTH_IN, bottom_in / height_in, width_in / WIDTH_IN, panel_in / height_in)
        )
    return figure, axes


def save(figure: Drawing, name: str, caption: str, folder: Path) -> Figure:
    """Write a figure in both formats.

    Raises:
        OSError: a file cannot be written.
    """
    png, svg = folder / f'{name}.png', folder / f'{name}.svg'
    # Not Figure.savefig, which draws each twice. Without version and date: equal data, equal bytes.
    png_canvas: Any = FigureCanvasAgg(figure)
    png_canvas.print_png(str(png), metadata={'Software': None})
    figure.set_dpi(SVG_DPI)
    svg_canvas: Any = FigureCanvasSVG(figure)
    svg_canvas.print_svg(str(svg), metadata={'Date': None, 'Creator': None})
    return Figure(name, caption, png, svg)


def shown_limit(cells: Sequence[np.ndarray], least: float) -> float:
    """Return half the width of axes around zero that show most values of every cell.

    Args:
        cells: values of each; empty ones do not count.
        least: is shown whatever the values.
    """
    magnitudes: List[np.ndarray] = [np.abs(values) for values in cells if len(values)]
    if not magnitudes:
        return least
    largest = max(float(values.max()) for values in magnitudes)
    median = max(float(np.median(values)) for values in magnitudes)
    return 1.08 * max(least, min(largest, MEDIAN_TIMES * median))


def round_ticks(most: int) -> MaxNLocator:
    """Return a locator of ticks at round numbers."""
    return MaxNLocator(most, steps=[1, 2, 2.5, 5, 10])


def hide_unused(axes: np.ndarray, used: int) -> None:
    """Hide the panels after the first `used` ones."""
    for panel in axes.flat[used:]:
        panel.set_visible(False)
