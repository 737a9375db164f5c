"""Figures of an analysis: charts of the report as reproducible PNG and SVG files."""

from __future__ import annotations

import functools
import itertools
import math
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Sequence, Tuple

import altair as alt
import numpy as np
import vl_convert
from altair.utils.schemapi import debug_mode

from diff_encoder_sim.analysis import results_table
from diff_encoder_sim.analysis.charts import drawings, frames
from diff_encoder_sim.analysis.charts.chart_page import VEGA_LITE, drawing_dict
from diff_encoder_sim.analysis.encoder_labels import is_real, ppr_text, ppr_value, ppr_values
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, X
from diff_encoder_sim.analysis.results_table import Results, encoders, first_of_cells, sample_text, varied_texts
from diff_encoder_sim.analysis.tables import KINDS, VARIANTS, first_variant, variant_errors
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.trials_csv import VARIANT

WIDTH_PX = 600  # width of a figure in SVG units
PNG_SCALE = 1.6
POINT_PX2 = 16
BETWEEN_PX, AXIS_PX = 12, 62  # space between panels, and for an axis with its title
THIRD_PX = WIDTH_PX // 3 - AXIS_PX - BETWEEN_PX

MEDIAN_TIMES = 6.0  # axes end at this multiple of the largest median of a cell; values beyond are drawn at the border
MOST_ABREAST, MOST_TRIALS, MOST_OBLONG = 5, 10, 3.6

VARIANTS_CAPTION = (
    'Final odometry error, /odom minus /world_pose, by variant: medians and quartiles, and the median of the first '
    'variant as dotted lines; hollow: some trials failed. The other figures show the first variant.'
)
XY_CAPTION = f'Final {{}} minus the goal; shaded: within {X.tolerance:g} m; crosses: beyond the axes'
DISTRIBUTION_CAPTION = (
    f'Final {{}} minus the goal by encoder, with median and quartiles; shaded: within {X.tolerance:g} m and '
    f'{YAW.tolerance:g} degrees; crosses: beyond the axes'
)
PATH_CAPTION = (
    f'{{}}: true paths (grey) and /odom, at most {MOST_TRIALS} trials per encoder; circle: start; plus: goal; cross: '
    'end of a failed trial'
)
SPREAD_CAPTION = (
    f"Standard deviation against the encoder's resolution, with 95 % intervals: "
    f'{", ".join(f"{symbol} {label}" for label, *_, symbol in drawings.SERIES)}; dashed: closed form of '
    'quantisation, for final poses that differ by more than a pulse'
)

_TEXT = {'labelFontSize': 10, 'titleFontSize': 10, 'titleFontWeight': 'normal', 'labelColor': '#333'}
CONFIG: Dict[str, Any] = {
    'font': 'sans-serif',
    'aria': False,
    'view': {'stroke': '#8a9099'},
    'axis': {**_TEXT, 'gridColor': '#e6e9ed', 'titlePadding': 3},
    'axisY': {'minExtent': 42},
    'title': {'fontSize': 10, 'fontWeight': 'normal', 'offset': 4},
    'concat': {'spacing': BETWEEN_PX},
}


class Figure(NamedTuple):
    """Written figure."""

    name: str
    caption: str
    png: Path
    svg: Path


_Panels = List[List[alt.LayerChart]]
_Drawn = Tuple[str, str, _Panels]  # figure to write: name, caption, and rows of panels


def write_figures(results: Results, folder: Path) -> List[Figure]:
    """Write all figures that have data into a new `folder`; OSError if a file cannot be written.

    If parameters other than the encoder are varied, each combination has separate figures. For named variants these
    show only the first, and one figure shows all.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with debug_mode(False):  # validation in Altair takes longer than the drawing
        return [_save(*drawn, folder) for drawn in _all_figures(results)]


def _all_figures(results: Results) -> Iterator[_Drawn]:
    trials, colours = results.trials, drawings.encoder_colours(encoders(results.trials))
    others = [key for key in results.varied if key != VARIANT]
    if VARIANT in results.varied:
        yield VARIANTS, VARIANTS_CAPTION, _variant_panels(results, colours, others)
        trials = trials[trials[VARIANT] == first_variant(trials)]
    parts = [part for _, part in trials.groupby(others, sort=False)] if others else [trials] * (not trials.empty)
    for number, part in enumerate(parts, start=1):
        suffix = '' if len(parts) == 1 else f'_variant{number}'
        texts = [', '.join(varied_texts(part[results.varied].iloc[0], results.varied))]
        texts.append(sample_text(first_of_cells(part), part))
        note = f' ({"; ".join(filter(None, texts))})' if any(texts) else ''
        for name, caption, rows in _figures(results, part, colours):
            yield name + suffix, f'{caption}{note}.', rows


def _save(name: str, caption: str, rows: _Panels, folder: Path) -> Figure:
    spec = {**drawing_dict(alt.vconcat(*(alt.hconcat(*row) for row in rows))), 'config': CONFIG}
    svg = vl_convert.vegalite_to_svg(spec, vl_version=VEGA_LITE)
    numbers: Dict[str, str] = {}  # Vega numbers clip paths across all figures of a process
    svg = re.sub(r'\b(clip|gradient_)\d+\b', lambda found: numbers.setdefault(found[0], f'part{len(numbers)}'), svg)
    figure = Figure(name, caption, folder / f'{name}.png', folder / f'{name}.svg')
    figure.svg.write_bytes(svg.encode('utf-8'))
    figure.png.write_bytes(vl_convert.svg_to_png(svg, scale=PNG_SCALE))
    return figure


def _figures(results: Results, trials: pd.DataFrame, colours: Dict[str, str]) -> Iterator[_Drawn]:
    """Yield the figures of trials with one setup per test."""
    errors = frames.error_rows(first_of_cells(trials))
    tests = dict(trials[['test', 'setup']].drop_duplicates().itertuples(index=False))
    label_of = {pose: label for label, pose in frames.OF_LABEL.items()}
    for kind, caption, panels in (
        ('fig4_xy_errors', XY_CAPTION, _xy_panels),
        ('fig5_distributions', DISTRIBUTION_CAPTION, _distribution_panels),
    ):
        for source, topic in TOPIC_OF_SOURCE.items():
            of_source = errors[errors['series'] == label_of[source.value]]
            of_tests = [panels(of_source[of_source['setup'] == setup], test, colours) for test, setup in tests.items()]
            yield f'{kind}_{source.value}', caption.format(topic), list(itertools.chain.from_iterable(of_tests))
    for test in tests:
        shown = frames.with_paths(trials[trials['test'] == test], MOST_TRIALS * len(colours))
        if test in results.requested and not shown.empty:
            yield f'trajectories_{test}', PATH_CAPTION.format(test), _path_panels(results, shown, colours)
    stds, closed_form, rows = frames.spread_rows(trials), frames.closed_form_rows(results), []
    counted = trials[trials['ppr'].map(ppr_value).notna()]
    several = counted[counted.duplicated(['test', 'ppr'])]['test'].unique()
    for test, quantity in itertools.product(several, QUANTITIES):
        measured, expected = (
            alt.Chart(one[(one['setup'] == tests[test]) & (one['quantity'] == quantity.axis)])
            for one in (stds, closed_form)
        )
        pprs = ppr_values(counted[counted['test'] == test]['ppr'])
        panel = drawings.spreads(measured, expected, pprs, f"'{quantity.unit}'")
        rows.append(panel.properties(width=THIRD_PX, height=THIRD_PX, title=f'{test}: {quantity.axis}'))
    if rows:
        has_real = any(map(is_real, encoders(trials)))
        yield 'spread_vs_ppr', SPREAD_CAPTION + '; hollow: real encoders' * has_real, _in_rows(rows, len(QUANTITIES))


def shown_limit(cells: Sequence[np.ndarray], least: float) -> float:
    """Return half the width of axes around zero that show most values of every cell that has any."""
    magnitudes = [np.abs(values) for values in cells if len(values)]
    largest = max((float(values.max()) for values in magnitudes), default=0.0)
    median = max((float(np.median(values)) for values in magnitudes), default=0.0)
    return 1.08 * max(least, min(largest, MEDIAN_TIMES * median))


def _xy_panels(of_test: pd.DataFrame, test: str, colours: Dict[str, str]) -> _Panels:
    """Return one or more rows of panels for a test, all with the same scale."""
    values = [of_test.loc[of_test['encoder'] == label, axis].to_numpy() for label in colours for axis in 'xy']
    limit_m = shown_limit(values, 1.2 * X.tolerance)
    places = of_test[['x', 'y']]
    beyond, inside = (places.abs() > limit_m).any(axis=1), (places.abs() <= X.tolerance).all(axis=1)
    drawn = of_test.assign(**places.clip(-limit_m, limit_m), series=of_test['series'].where(~beyond, drawings.BEYOND))
    columns = math.ceil(len(colours) / math.ceil(len(colours) / MOST_ABREAST))
    size = (WIDTH_PX - AXIS_PX) // max(columns, 3) - BETWEEN_PX
    panels, points = [], functools.partial(drawings.error_points, colours=colours, size_px2=POINT_PX2)
    for place, label in enumerate(colours):
        is_of, is_first = of_test['encoder'] == label, place % columns == 0
        counts = f'{inside[is_of].sum()} of {is_of.sum()} within'
        counts += f', {beyond[is_of].sum()} beyond' if beyond[is_of].any() else ''
        panel = drawings.xy_errors(alt.Chart(drawn[is_of]), points, [-limit_m, limit_m])
        if not is_first:
            panel.layer[-1].encoding.y.axis = alt.Axis(labels=False, title=None, tickCount=4, minExtent=0)
        name = f'{test}: {ppr_text(label)}' if is_first else ppr_text(label)
        panels.append(panel.properties(width=size, height=size, title=[*name.replace(' (', '\n(').split('\n'), counts]))
    return _in_rows(panels, columns)


def _in_rows(panels: List[alt.LayerChart], columns: int) -> _Panels:
    return [panels[first : first + columns] for first in range(0, len(panels), columns)]


def _distribution_panels(of_test: pd.DataFrame, test: str, colours: Dict[str, str]) -> _Panels:
    """Return a panel per quantity."""
    panels, points = [], functools.partial(drawings.error_points, colours=colours, size_px2=POINT_PX2)
    for quantity in QUANTITIES:
        values = of_test[quantity.axis]
        cells = [of_cell.to_numpy() for _, of_cell in values.groupby(of_test['encoder'])]
        limit = shown_limit(cells, 1.3 * quantity.tolerance)
        series = of_test['series'].where(values.abs() <= limit, drawings.BEYOND)
        rows = alt.Chart(of_test.assign(value=values.clip(-limit, limit), slot=0, series=series))
        names, unit = {label: label for label in colours}, f"'{quantity.unit}'"
        panel = drawings.distributions(rows, points, names, unit, str(quantity.tolerance), domain=[-limit, limit])
        panels.append(panel.properties(width=THIRD_PX, height=THIRD_PX, title=f'{test}: {quantity.axis}'))
    return [panels]


def _path_panels(results: Results, shown: pd.DataFrame, colours: Dict[str, str]) -> _Panels:
    """Return a panel per encoder, all with the same scale; `shown` are trials of one test."""
    floors = frames.floor_rows(shown, results)
    [test], (x_m, y_m, width_m, height_m) = floors.index, floors.iloc[0]
    width_m, height_m = max(width_m, height_m / MOST_OBLONG), max(height_m, width_m / MOST_OBLONG)
    domains = ([[x_m], [y_m]] + np.outer([width_m, height_m], [-0.5, 0.5])).tolist()
    labels = [label for label in colours if (shown['ppr'] == label).any()]
    columns = 1 if width_m > 2.0 * height_m and len(labels) <= 4 else min(len(labels), 2)
    width = (WIDTH_PX - AXIS_PX) // max(columns, 2 if height_m > width_m else 1) - AXIS_PX
    marks, maps = frames.mark_rows(results, [test]), alt.Chart(frames.map_rows(results, [test]))
    paths, panels = frames.path_rows(shown, floors), []
    for label in labels:
        failed = shown[(shown['ppr'] == label) & (shown['outcome'] != results_table.SUCCEEDED)]
        of_ends = [(test, 'end of a failed trial', *path[-1]) for path in failed['true_path']]
        marked = alt.Chart(pd.concat([marks, pd.DataFrame(of_ends, columns=marks.columns)]))
        panel = drawings.path_chart(alt.Chart(paths[paths['encoder'] == label]), marked, maps, colours, domains)
        height = round(width * height_m / width_m)
        panels.append(panel.properties(width=width, height=height, title=f'{test}: {ppr_text(label)}'))
    return _in_rows(panels, columns)


def _variant_panels(results: Results, colours: Dict[str, str], others: Sequence[str]) -> _Panels:
    """Return a row per test and other parameters, with position and heading by variant."""
    errors, names, panels = variant_errors(results), list(results.trials[VARIANT].unique()), []
    size = {'width': (WIDTH_PX - 180) // 2, 'height': len(names) * max(16, 8 * len(colours))}
    errors = errors.assign(variant=errors[VARIANT], encoder=errors['ppr'], has_failed=errors['failed'] > 0)
    for (test, *values), of_test in errors.groupby(['test', *others], sort=False):
        title = ', '.join([test, *varied_texts(values, others)])
        for kind in KINDS:
            drawn = of_test.loc[of_test['error'] == kind, ['variant', 'encoder', 'median', 'low', 'high', 'has_failed']]
            text = kind.replace('_', ' [') + ']'
            panel = drawings.variant_errors_chart(drawn, names, colours, text)
            panels.append(panel.properties(**size, title=f'{title}: {text}'))
    return _in_rows(panels, len(KINDS))
