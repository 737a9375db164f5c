"""A calibration as an HTML page that works offline: paths, residuals, confidence ellipses, predictions and tables."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Mapping, Optional, Sequence

import altair as alt
import numpy as np
from altair.utils.schemapi import debug_mode

from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.analysis.charts.chart_page import Chart, Choice, Option, chart_of, with_legend, zoomed
from diff_encoder_sim.analysis.charts.drawings import GREY, PLAIN, equal_axes, floor_of, tips
from diff_encoder_sim.analysis.report.about import PageAbout, save_page
from diff_encoder_sim.calibration.calibration_tables import AXES, TO_SHOWN, calibration_tables, kind_of, summary
from diff_encoder_sim.calibration.estimation import Calibration, Fit
from diff_encoder_sim.calibration.prediction import Prediction
from diff_encoder_sim.calibration.umbmark import LENGTHS, WheelGeometry

ORANGE, BLUE = '#d55e00', '#0072b2'  # safe for colour-blind readers (Okabe and Ito, 2008)
PATHS = {'reference': GREY, 'before': ORANGE, 'after': BLUE}
MOST_POINTS = 1000  # of a path
ELLIPSES = {'50 %': 1.386, '95 %': 5.991}  # squared Mahalanobis distances in two dimensions
OF_DRIVE, OF_AXIS = 'datum.drive === drive', 'datum.axis === axis'
MOST_BUTTONS = 3  # more drives become a list


def write_page(
    found: Calibration,
    predictions: Sequence[Prediction],
    nominal: Optional[WheelGeometry],
    sources: Sequence[Mapping[str, str]],
    about: PageAbout,
    path: Path,
) -> None:
    """Write the page atomically; OSError if the file cannot be written."""
    drives = [fit.drive for fit in found.fits]
    look: Any = 'radio' if len(drives) <= MOST_BUTTONS else 'select'
    choices = [
        Choice('drive', 'Drive', [Option(drive, drive) for drive in drives], drives[0], look),
        Choice('axis', 'Error', [Option(axis, axis) for axis in AXES], 'across', 'radio'),
    ]
    with debug_mode(False):  # validation in Altair takes longer than the drawing
        charts = [_path_chart(found.fits), _residual_chart(found)]
        charts += [] if {*LENGTHS} & {*found.undetermined} else [_ellipse_chart(found, nominal)]
        charts += [_prediction_chart(predictions)] if predictions else []
        block = chart_page.charts_html(charts, choices)
    save_page(
        path,
        Path(__file__).with_name('calibration.html'),
        about,
        summary=summary(found, nominal is not None),
        sources=sources,
        charts=block,
        tables=list(calibration_tables(found, predictions)),
    )


def _path_chart(fits: Sequence[Fit]) -> Chart:
    rows, floors = [], {}
    for fit in fits:
        paths = {'reference': fit.reference, 'before': fit.before, 'after': fit.after}
        shown = {name: path[:: len(path) // MOST_POINTS + 1, :2] for name, path in paths.items() if path is not None}
        for name, path in shown.items():
            places = enumerate(path.round(4).tolist())
            rows += [{'drive': fit.drive, 'path': name, 'order': order, 'x': x, 'y': y} for order, (x, y) in places]
        ends = np.concatenate([*shown.values()])
        floors[fit.drive] = floor_of(ends)
    axes = equal_axes({key: f'floor.{key}' for key in floors[fits[0].drive]})
    names = {name: colour for name, colour in PATHS.items() if any(row['path'] == name for row in rows)}
    colour = with_legend(alt.Color, 'path:N', names, columns=3, symbolType='stroke')
    width = alt.condition("datum.path === 'reference'", alt.value(4), alt.value(1.4))
    named = [*tips({'path': 'path'}), *tips({'x': 'x [m]', 'y': 'y [m]'}, '.3f')]
    lines = chart_of(rows, OF_DRIVE).mark_line(clip=True, strokeJoin='round')
    lines = lines.encode(order='order:Q', color=colour, strokeWidth=width, tooltip=named, **axes)
    floor = [alt.param(name='floor_of', value=floors), alt.param(name='floor', expr='floor_of[drive]')]
    text = 'The reference sensor: as measured, and by odometry, turned and shifted to fit best'
    text += ', before and after the calibration.' if 'before' in names else '.'
    return Chart('path', 'Path', text, alt.layer(zoomed(lines)).add_params(*floor))


def _residual_chart(found: Calibration) -> Chart:
    axes = list(AXES)
    rows = [
        {'drive': fit.drive, 'axis': axes[column], 'time': fit.window_times_s[row], 'residual': residual}
        for fit in found.fits
        for (row, column), residual in np.ndenumerate(fit.residuals)
        if math.isfinite(residual)
    ]
    spans = [{**one._asdict(), 'what': kind_of(one)} for one in found.disturbances]
    x, y = alt.X('time:Q', title='time [s]'), alt.Y('residual:Q', title='residual [standard deviations]')
    named = tips({'time': 'time [s]', 'residual': 'residual'}, '.2f')
    points = chart_of(rows, OF_DRIVE, OF_AXIS).mark_point(filled=True, size=25, color=BLUE, clip=True)
    layers = [zoomed(points.encode(x=x, y=y, tooltip=named))]
    if spans:
        shaded = chart_of(spans, OF_DRIVE).mark_rect(color='#000', opacity=0.12, clip=True)
        what = {'x': alt.X('start_s:Q', title='time [s]'), 'x2': 'end_s:Q', 'tooltip': tips({'what': 'disturbance'})}
        layers.insert(0, shaded.encode(**what))
    text = 'Motion by the reference minus motion by odometry, in expected standard deviations; shaded: disturbances.'
    return Chart('residuals', 'Residuals over time', text, alt.layer(*layers))


def _ellipse_chart(found: Calibration, nominal: Optional[WheelGeometry]) -> Chart:
    of_logarithms = np.array([[-1.0, 1.0, 0.0], [1.0, 0.0, -1.0]])  # ratio, left radius / separation
    variances, directions = np.linalg.eigh(of_logarithms @ found.geometry_covariance @ of_logarithms.T)
    angles_rad = np.linspace(0.0, 2.0 * np.pi, 73)[:, np.newaxis]
    circle = np.hstack([np.cos(angles_rad), np.sin(angles_rad)])
    offsets = circle * np.sqrt(np.maximum(variances, 0.0)) @ directions.T
    centre = [found.values[name].value for name in ('radius_ratio', 'radius_per_separation')]
    rows = [
        {'level': level, 'order': order, 'ratio': ratio, 'turn': turn}
        for level, squared in ELLIPSES.items()
        for order, (ratio, turn) in enumerate((centre * np.exp(math.sqrt(squared) * offsets)).tolist())
    ]
    channels = alt.X('ratio:Q', title='right / left radius'), alt.Y('turn:Q', title='left radius / separation')
    x, y = (channel.scale(zero=False).axis(format='.7~g', tickCount=5) for channel in channels)
    dash = with_legend(alt.StrokeDash, 'level:N', dict(zip(ELLIPSES, ([1, 0], [4, 3]))), columns=2)
    lines = chart_of(rows).mark_line(color=BLUE, clip=True).encode(x=x, y=y, order='order:Q', strokeDash=dash)
    middle = chart_of([dict(zip(('ratio', 'turn'), centre))]).mark_point(filled=True, color=BLUE, size=50)
    text = 'The two numbers on which the shape of a path depends.'
    if nominal is not None:
        ratio, turn = nominal.right_diameter_m / nominal.left_diameter_m, 0.5 * nominal.left_diameter_m / nominal[2]
        text += f' Nominal: {ratio:.6g} and {turn:.6g}.'
    return Chart('ellipses', 'Confidence regions', text, alt.layer(zoomed(lines), middle.encode(x=x, y=y)))


def _prediction_chart(predictions: Sequence[Prediction]) -> Chart:
    rows = [
        {'drive': each.drive, 'axis': axis, 'place': place, 'error': error, 'low': low, 'high': high}
        for each in predictions
        for row, (axis, unit) in enumerate(AXES.items())
        for error, low, high in [TO_SHOWN[unit] * np.append(each.error[row], each.interval[row])]
        for place in ['inside' if each.is_inside[row] else 'outside']
        if math.isfinite(error)
    ]
    label = f"format(datum.value, '{PLAIN}') + ' ' + {AXES}[axis]"
    y = alt.Y('drive:N', title=None).axis(labelLimit=180)
    error, low = (
        alt.X(f'{field}:Q', title='error at the end').axis(labelExpr=label, tickCount=5) for field in ('error', 'low')
    )
    bars = chart_of(rows, OF_AXIS).mark_bar(height=14, color='#000', opacity=0.15).encode(x=low, x2='high:Q', y=y)
    colour = with_legend(alt.Color, 'place:N', {'inside': BLUE, 'outside': ORANGE}, columns=2)
    named = [*tips({'drive': 'drive'}), *tips({'error': 'observed', 'low': '90 % from', 'high': 'to'}, '.3~g')]
    dots = chart_of(rows, OF_AXIS).mark_point(filled=True, size=70, opacity=1.0)
    dots = dots.encode(x=error, y=y, color=colour, tooltip=named)
    text = 'Bar: 90 % interval of the predicted error of odometry; dot: observed.'
    return Chart('prediction', 'Prediction', text, alt.layer(bars, dots), 'tables')
