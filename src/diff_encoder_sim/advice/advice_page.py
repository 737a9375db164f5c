"""Advice as an HTML page that works offline: answers, interactive charts and tables."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any, Dict, List, Mapping, Tuple

import altair as alt
import numpy as np
from altair.utils.schemapi import debug_mode
from markupsafe import Markup

from diff_encoder_sim.advice import advice_tables as tables
from diff_encoder_sim.advice.advice_tables import DECIMALS, TO_SHOWN
from diff_encoder_sim.advice.answers import AXES, Budget, Criterion, along_goal
from diff_encoder_sim.advice.drive_draws import DrawnRobot
from diff_encoder_sim.advice.fused_draws import STANDSTILL_S, assumed_wheels
from diff_encoder_sim.advice.odometry_answer import FEWEST_COUNTS, MOST_COUNTS
from diff_encoder_sim.advice.odometry_study import Advice
from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.analysis.charts.chart_page import Chart, Choice, Option, chart_of, with_legend, zoomed
from diff_encoder_sim.analysis.charts.drawings import PLAIN, tips
from diff_encoder_sim.analysis.closed_form import crossover_counts, gyro_heading_std_rad, wheels_heading_std_rad
from diff_encoder_sim.analysis.report.about import PageAbout, save_page
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.analysis.statistics import wilson
from diff_encoder_sim.base.imu import ImuParams

# Colours of criteria and causes, safe for colour-blind readers (Okabe and Ito, 2008; the last by Tol).
COLOURS = {Criterion.ODOMETRY: '#d55e00', Criterion.POSE_ESTIMATE: '#0072b2', Criterion.TRUTH: '#009e73'}
GREY = '#565d66'
CAUSES = ('#0072b2', '#e69f00', '#009e73', '#cc79a7', '#56b4e9', '#d55e00', '#f0e442', '#999999', '#882255')

UNITS = ('mm', 'mm', 'degrees')
SMALLEST_ERROR = 1e-4  # lower limit of the logarithmic axis; smaller bars are invisible [mm, degrees]
SHARES = np.round(np.linspace(0.02, 0.99, 98), 2)  # success rates of the closed-form line
COLUMNS = {'expr': 'width < 420 ? 1 : 2'}  # of long legends, by the width of the chart [px]
TICKS = [10, 30, 100, 300, 1000, 3000, 10000, 30000]

ENCODERS, SPEEDS_MPS = (40.0, 90.0, 250.0, 1024.0, 4096.0), {0.1: '#8a9099', 0.5: GREY}  # of the chart of headings
TIMES_S, HEADINGS_DEG = np.geomspace(1.0, 3600.0, 50), (0.005, 20.0)

BESIDE = {Criterion.ODOMETRY: 1 / 1.1, Criterion.POSE_ESTIMATE: 1.0, Criterion.TRUTH: 1.1}  # factors apart

OF_TEST, OF_AXIS, OF_CRITERION = (f'datum.{name} === {name}' for name in ('test', 'axis', 'criterion'))
_COUNTS = (
    alt.X('counts:Q', title='counts per wheel turn')
    .scale(type='log', domain=[FEWEST_COUNTS, MOST_COUNTS], nice=False)
    .axis(values=TICKS, format='d', labelOverlap=True)
)

PRODUCTS: tables.Products = {
    'manufacturer': lambda file: file.manufacturer,
    'part (documentation)': lambda file: (
        Markup('<a href="{}">{}</a>').format(file.link, file.part) if file.link else file.part
    ),
    'type': lambda file: file.type,
    **tables.PRODUCTS,
}

Rows = List[Dict[str, Any]]


def write_page(advice: Advice, about: PageAbout, path: Path) -> None:
    """Write the page atomically; OSError if the file cannot be written."""
    with debug_mode(False):  # validation in Altair takes longer than the drawing
        charts = advice_charts(advice)
    scope = [
        f'{curve.test}: at least {min(map(len, curve.errors.values()))} samples of one drive with '
        f'{curve.draws.drive.wheel_way_m:.3g} m per wheel'
        for curve in advice.curves.curves
    ]
    trials = sum(tried.within[Criterion.TRUTH].trials for tried in advice.tried)
    save_page(
        path,
        Path(__file__).with_name('advice.html'),
        about,
        advice=advice,
        scope='; '.join([*scope, *([f'{trials} closed-loop trials'] if trials else [])]) + '.',
        answer={**tables.summary(advice), 'assumptions': tables.assumptions_text(advice)},
        closed_form=tables.closed_form_text(advice),
        own_encoder=tables.own_encoder_text(advice),
        charts=charts,
        tables=list(tables.advice_tables(advice, PRODUCTS)),
    )


def advice_charts(advice: Advice) -> Markup:
    """Return the block of charts."""
    tests = dict.fromkeys([*(curve.test for curve in advice.curves.curves), *(tried.test for tried in advice.tried)])
    choices = [
        Choice('test', 'Test', [Option(test, test) for test in tests], next(iter(tests)), 'radio'),
        Choice('axis', 'Error', [Option(axis, axis) for axis in AXES], AXES[1], 'radio'),
    ]
    if _has_truth(advice):
        criteria = [Option(criterion.value, criterion.text) for criterion in (Criterion.ODOMETRY, Criterion.TRUTH)]
        choices.append(Choice('criterion', 'Budget of', criteria, Criterion.ODOMETRY.value, 'radio'))
    charts = [_share_chart(advice), _error_chart(advice), _budget_chart(advice)]
    if advice.imus:
        robots = {answer.wheels.text: answer.curves[0].fused.robot for answer in advice.imus}
        charts[:0] = [heading_chart({each.name: each.params for each in advice.imus}, advice.geometry, robots)]
    return chart_page.charts_html(charts, choices)


def _has_truth(advice: Advice) -> bool:
    """Return whether there is a budget of the true pose at the goal."""
    return any(tried.budget for tried in advice.tried)


def _share(field: str = 'share') -> alt.Y:
    return alt.Y(f'{field}:Q', title='within the tolerance').scale(domain=[0, 1]).axis(format='%')


def _share_chart(advice: Advice) -> Chart:
    requirement, of_odometry = advice.requirement, COLOURS[Criterion.ODOMETRY]
    colours = {each.text: colour for each, colour in COLOURS.items() if each in advice.answers}
    colour = with_legend(alt.Color, 'criterion:N', colours)
    curves = []
    for curve in advice.curves.curves:
        key = {'test': curve.test, 'criterion': Criterion.ODOMETRY.text}
        for counts, errors in sorted(curve.errors.items()):
            share = round(float(np.mean(requirement.within(errors))), 4)
            curves.append({**key, 'counts': counts, 'share': share, 'samples': len(errors)})
    asked = [advice._replace(requirement=requirement._replace(share=float(share))) for share in SHARES]
    closed = [
        {'test': test, 'counts': float(f'{counts:.4g}'), 'share': each.requirement.share}
        for each in asked
        for test, counts in each.closed_form.items()
        if FEWEST_COUNTS <= counts <= MOST_COUNTS
    ]
    encoders = [
        {'encoder': one.name, 'counts': round(one.ppr, 3), 'share': round(share, 4), 'trials': one.share_text}
        for one, share in ((one, sum(one.odometry_share) / 2.0) for one in advice.encoders)
    ]
    layers = [
        chart_of([{'share': requirement.share}]).mark_rule(color=GREY).encode(y=_share()),
        zoomed(chart_of(curves, OF_TEST).mark_line(clip=True).encode(x=_COUNTS, y=_share(), color=colour)),
        _nearest(curves, {'share': ('within the tolerance', '.1%'), 'samples': ('samples', 'd')}).encode(y=_share()),
    ]
    if closed:
        line = chart_of(closed, OF_TEST).mark_line(strokeDash=[2, 3], color=of_odometry, clip=True)
        layers.append(line.encode(x=_COUNTS, y=_share()))
    if advice.tried:
        tried = chart_of(_tried_rows(advice), OF_TEST).encode(x=_COUNTS, color=colour)
        dots = tips({'encoder': 'encoder', 'criterion': 'criterion', 'trials': 'trials within'})
        layers.append(tried.mark_rule(clip=True).encode(y=_share('low'), y2='high:Q'))
        layers.append(tried.mark_point(filled=True, size=60, clip=True).encode(y=_share(), tooltip=dots))
    diamonds = chart_of(encoders).mark_point(shape='diamond', size=60, color=of_odometry, clip=True)
    named = tips({'encoder': 'encoder', 'counts': 'counts', 'trials': 'draws within'})
    layers.append(diamonds.encode(x=_COUNTS, y=_share(), tooltip=named))
    dots_text = 'dots: closed-loop trials with the confidence interval; ' if advice.tried else ''
    description = (
        'Line: odometry, sampled drives; dotted: odometry in closed form, quantisation only, for the axis '
        f'that needs the most counts; {dots_text}diamonds: odometry '
        'with the encoders of the table in their worst test; grey: the required fraction.'
    )
    return Chart('share', 'How many trials are within the tolerance', description, alt.layer(*layers))


def _nearest(rows: Rows, titles: Dict[str, Tuple[str, str]], *filters: str) -> alt.Chart:
    """Return the points of lines, of which the one nearest to the pointer is shown, with a tooltip of its numbers.

    `titles` are title and format by field: the tooltips of Vega-Lite's nearest points have no texts.
    """
    named = [alt.Tooltip(f'{field}:Q', title=title, format=form) for field, (title, form) in titles.items()]
    nearest = alt.selection_point(name='nearest', nearest=True, on='mouseover', clear='mouseout', empty=False)
    points = chart_of(rows, OF_TEST, *filters).mark_point(filled=True, size=60, color=GREY, clip=True, aria=False)
    seen = alt.condition(nearest, alt.value(1.0), alt.value(0.0))
    counts = alt.Tooltip('counts:Q', title='counts', format=PLAIN)
    return points.encode(x=_COUNTS, opacity=seen, tooltip=[counts, *named]).add_params(nearest)


def _tried_rows(advice: Advice) -> Rows:
    rows = []
    for tried in advice.tried:
        for criterion, counts in tried.within.items():
            low, high = counts.interval(advice.requirement.confidence)
            key = {'test': tried.test, 'encoder': tried.encoder, 'criterion': criterion.text}
            shares = {'share': round(counts.within / counts.trials, 4), 'low': round(low, 4), 'high': round(high, 4)}
            trials = f'{counts.within} of {counts.trials}'
            rows.append({**key, 'counts': tried.ppr * BESIDE[criterion], **shares, 'trials': trials})
    return rows


def _error_chart(advice: Advice) -> Chart:
    share = advice.requirement.share
    lines = {'half': 0.5, f'{100.0 * share:g} %': share, '95 %': 0.95}
    rows = []
    for curve in advice.curves.curves:
        for counts, errors in sorted(curve.errors.items()):
            shown = np.abs(along_goal(errors, curve.draws.drive.goal_in_map)) * TO_SHOWN
            for line, level in lines.items():
                for axis, error in zip(AXES, np.maximum(np.quantile(shown, level, axis=0), SMALLEST_ERROR)):
                    key = {'test': curve.test, 'counts': counts, 'line': line, 'axis': axis}
                    rows.append({**key, 'level': level, 'error': float(f'{error:.4g}')})
    y = alt.Y('error:Q', title='error [mm, degrees]').scale(type='log')
    dash = with_legend(alt.StrokeDash, 'line:N', dict(zip(lines, ([2, 1], [1, 0], [4, 2]))))
    drawn = chart_of(rows, OF_TEST, OF_AXIS).mark_line(clip=True).encode(x=_COUNTS, y=y, strokeDash=dash)
    text = 'Quantiles of the sampled drives: half, the required fraction, and 95 %; grey: the tolerance.'
    points = _nearest(rows, {'level': ('samples', '.0%'), 'error': ('error at most [mm, degrees]', '.3~r')}, OF_AXIS)
    layers = [_tolerance_rule(advice, y), zoomed(drawn), points.encode(y=y)]
    if advice.imus:
        text += f' Coloured: {100.0 * share:g} % with an IMU, and the interval.'
        band = _fused_curves(advice).encode(x=_COUNTS)
        layers += [band.mark_area(opacity=0.25, clip=True).encode(y='low:Q', y2='high:Q')]
        layers += [band.mark_line(clip=True).encode(y=y)]
    return Chart('error', "Odometry's error against the counts", text, alt.layer(*layers))


def _fused_curves(advice: Advice) -> alt.Chart:
    """Return the errors with each IMU that the required fraction of the drives does not exceed, on the first wheels."""
    rows, share, names = [], advice.requirement.share, list(dict.fromkeys(each.name for each in advice.imus))
    for answer in advice.imus[: len(names)]:
        levels = share, *wilson(round(share * answer.draws), answer.draws, advice.requirement.confidence)
        for curve in answer.curves:
            for counts, errors in curve.errors.items():
                shown = np.abs(along_goal(errors, curve.fused.drive.goal_in_map)) * TO_SHOWN
                key = {'test': curve.plain.test, 'IMU': answer.name, 'counts': counts}
                for axis, found in zip(AXES, np.maximum(np.quantile(shown, levels, axis=0), SMALLEST_ERROR).T.tolist()):
                    rows.append({**key, 'axis': axis, **dict(zip(('error', 'low', 'high'), found))})
    colour = with_legend(alt.Color, 'IMU:N', dict(zip(names, CAUSES[1:])), columns=3, symbolOpacity=1)
    return chart_of(rows, OF_TEST, OF_AXIS).encode(color=colour)


def heading_chart(imus: Mapping[str, ImuParams], geometry: RobotGeometry, robots: Mapping[str, DrawnRobot]) -> Chart:
    """Return the heading errors over time, in closed form: gyroscopes, encoders, and wheels that drift, by name."""
    stds_rad = {name: gyro_heading_std_rad(imu, STANDSTILL_S, TIMES_S) for name, imu in imus.items()}
    looks, still, rows = dict(zip(imus, CAUSES[1:])), np.zeros_like(TIMES_S), []
    for name, (speed_mps, grey) in itertools.product(robots, SPEEDS_MPS.items()):
        wheels, line = assumed_wheels(robots[name], robots[name].odometry), f'{name}, {speed_mps:g} m/s'
        of_path = wheels.travel_variance, wheels.diameter_difference_std
        if any(of_path):
            looks[line] = grey
            stds_rad[line] = wheels_heading_std_rad(geometry, math.inf, speed_mps * TIMES_S, *of_path)
    for line, stds in stds_rad.items():
        for numbers in zip(TIMES_S, np.degrees(stds), crossover_counts(geometry, np.maximum(stds, 1e-9), still)):
            rows.append({'line': line, 'is_gyro': line in imus, **dict(zip(('time', 'error', 'counts'), numbers))})
    of_counts = (wheels_heading_std_rad(geometry, counts, still, 0.0, 0.0)[0] for counts in ENCODERS)
    encoders = [{'text': f'{counts:g} counts', 'error': math.degrees(std)} for counts, std in zip(ENCODERS, of_counts)]
    scale = alt.Scale(type='log', domain=[TIMES_S[0], TIMES_S[-1]], nice=False)
    x = alt.X('time:Q', title='time since the start [s]', scale=scale).axis(values=[1, 10, 60, 600, 3600], format='d')
    y = alt.Y('error:Q', title='heading error [degrees]').scale(type='log', domain=HEADINGS_DEG).axis(format=PLAIN)
    named = [*tips({'line': 'heading by'}), *tips({'time': 'seconds', 'error': 'degrees', 'counts': 'counts'}, '.2~r')]
    dash = alt.condition('datum.is_gyro', alt.value([1, 0]), alt.value([6, 3]))
    lines = chart_of(rows).mark_line(clip=True).encode(x=x, y=y, tooltip=named, strokeDash=dash)
    labels = chart_of(encoders).mark_text(align='right', dx=-4, dy=-6, color=GREY)
    drawing = alt.layer(
        chart_of(encoders).mark_rule(strokeDash=[2, 3], color=GREY).encode(y=y),
        labels.encode(x=alt.value('width'), y=y, text='text:N'),
        zoomed(lines.encode(color=with_legend(alt.Color, 'line:N', looks, columns=COLUMNS))),
    )
    text = (
        f'The lower line wins. Gyroscopes drift with time, after {STANDSTILL_S:g} s at rest; encoders (dotted) do not; '
        'wheels drift with distance (dashed). Standard deviations on a straight line, in closed form.'
    )
    return Chart('heading', 'Encoder or gyroscope', text, drawing)


def _budget_chart(advice: Advice) -> Chart:
    rows: Rows = []
    for test, budgets in advice.budgets.items():
        for counts, budget in budgets.items():
            rows += _bars(test, Criterion.ODOMETRY, f'{counts:g}', counts, budget)
    for tried in advice.tried:
        if tried.budget:
            rows += _bars(tried.test, Criterion.TRUTH, tried.encoder, tried.ppr, tried.budget)
    colours = dict(zip(dict.fromkeys(row['cause'] for row in rows), CAUSES))
    colour = with_legend(alt.Color, 'cause:N', colours, columns=COLUMNS)
    x = alt.X('encoder:O', title='counts per wheel turn', sort=alt.EncodingSortField('counts'))
    named = tips({'encoder': 'encoder', 'cause': 'cause', 'mean': 'mean', 'deviation': 'standard deviation'})
    title = 'rms [mm, degrees]'
    bars = chart_of(rows, OF_TEST, OF_AXIS, *([OF_CRITERION] if _has_truth(advice) else [])).mark_bar()
    bars = bars.encode(x=x, y=alt.Y('rms:Q', title=title), color=colour, tooltip=named)
    layers = [bars, _tolerance_rule(advice, alt.Y('error:Q', title=title))]
    without = {tried.test for tried in advice.tried} - {tried.test for tried in advice.tried if tried.budget}
    if without and _has_truth(advice):
        missing = [{'test': test, 'criterion': Criterion.TRUTH.value} for test in sorted(without)]
        too_few = chart_of(missing, OF_TEST, OF_CRITERION)
        layers.append(too_few.mark_text(text='too few trials came to the goal', color=GREY))
    text = 'Height: root mean square error, divided in proportion to mean squares. Grey: the tolerance.'
    return Chart('budget', 'Error budget', text, alt.layer(*layers))


def _bars(test: str, criterion: Criterion, label: str, counts: float, budget: Budget) -> Rows:
    """Return the bars of one encoder: parts of the root mean square, in proportion to the mean squares."""
    named = {**budget.parts, 'rest': budget.rest}
    squares = {cause: np.maximum(part.bias**2 + part.variance, 0.0) for cause, part in named.items()}
    total = np.maximum(sum(squares.values()), 1e-18)
    heights = {cause: square / np.sqrt(total) * TO_SHOWN for cause, square in squares.items()}
    key = {'test': test, 'criterion': criterion.value, 'encoder': label, 'counts': counts}
    return [
        {
            **key,
            'cause': cause,
            'axis': axis,
            'rms': float(f'{heights[cause][index]:.4g}'),
            'mean': f'{part.bias[index] * TO_SHOWN[index]:.{DECIMALS[index]}f} {UNITS[index]}',
            'deviation': f'{part.std[index] * TO_SHOWN[index]:.{DECIMALS[index]}f} {UNITS[index]}',
        }
        for cause, part in named.items()
        for index, axis in enumerate(AXES)
        if heights[cause][index] >= SMALLEST_ERROR  # otherwise only the legend would show it
    ]


def _tolerance_rule(advice: Advice, y: alt.Y) -> alt.Chart:
    """Return the tolerance of the chosen axis as a horizontal line."""
    shown = (advice.requirement.tolerances * TO_SHOWN).tolist()
    rows = [{'axis': axis, 'error': error} for axis, error in zip(AXES, shown)]
    return chart_of(rows, OF_AXIS).mark_rule(color=GREY).encode(y=y)
