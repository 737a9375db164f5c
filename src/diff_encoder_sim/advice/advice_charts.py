"""The interactive charts of an advice: curves over the counts, and the budget as stacked bars."""

from __future__ import annotations

from typing import Any, Dict, List

from markupsafe import Markup

from diff_encoder_sim.advice.advice import Advice
from diff_encoder_sim.advice.advice_chart_data import chart_data
from diff_encoder_sim.advice.advice_tables import TO_SHOWN
from diff_encoder_sim.advice.answers import AXES, Criterion
from diff_encoder_sim.advice.odometry_curve import FEWEST_COUNTS, MOST_COUNTS
from diff_encoder_sim.analysis.charts import Chart, Choice, Look, Option, charts_html
from diff_encoder_sim.analysis.charts.chart import ZOOM

# Of criteria, and of causes in their order: told apart by the colour-blind (Okabe and Ito, 2008).
COLOURS = {Criterion.ODOMETRY: '#d55e00', Criterion.POSE_ESTIMATE: '#0072b2', Criterion.TRUTH: '#009e73'}
GREY = '#565d66'
CAUSES = ('#0072b2', '#e69f00', '#009e73', '#cc79a7', '#56b4e9', '#d55e00', '#f0e442', '#999999')

Spec = Dict[str, Any]

_COUNTS: Spec = {
    'field': 'counts',
    'type': 'quantitative',
    'scale': {'type': 'log', 'domain': [FEWEST_COUNTS, MOST_COUNTS], 'nice': False},
    'title': 'counts per revolution',
    'axis': {'values': [10, 30, 100, 300, 1000, 3000, 10000, 30000], 'format': 'd', 'labelOverlap': True},
}
_BELOW = {'orient': 'bottom', 'columns': 1}
_SHARE: Spec = {
    'field': 'share',
    'type': 'quantitative',
    'scale': {'domain': [0.0, 1.0]},
    'title': 'within the tolerance',
    'axis': {'format': '%'},
}
_REQUIRED = {'type': 'rule', 'color': GREY}
_OF_TEST = {'filter': 'datum.test === test'}
_OF_CRITERION = {'filter': 'datum.criterion === criterion'}


def advice_charts(advice: Advice) -> Markup:
    """Return the block of charts."""
    charts = [_share_chart(advice), _error_chart(advice), _budget_chart(advice)]
    return charts_html(charts, chart_data(advice), _choices(advice))


def _choices(advice: Advice) -> List[Choice]:
    tests = [curve.test for curve in advice.curves.curves]
    tests += [tried.test for tried in advice.tried if tried.test not in tests]
    choices = [
        Choice('test', 'Test', [Option(test, test) for test in dict.fromkeys(tests)], tests[0], Look.BUTTONS),
        Choice('axis', 'Error', [Option(axis, axis) for axis in AXES], AXES[1], Look.BUTTONS),
    ]
    if _has_truth(advice):
        criteria = [Option(criterion.value, criterion.text) for criterion in (Criterion.ODOMETRY, Criterion.TRUTH)]
        choices.append(Choice('criterion', 'Budget of', criteria, Criterion.ODOMETRY.value, Look.BUTTONS))
    return choices


def _has_truth(advice: Advice) -> bool:
    """Return whether there is a budget of the true pose at the goal."""
    return any(tried.truth for tried in advice.tried)


def _share_chart(advice: Advice) -> Chart:
    required = {'data': {'values': [{'share': advice.requirement.share}]}, 'mark': _REQUIRED, 'encoding': {'y': _SHARE}}
    # A legend has the whole domain of a scale, with or without marks.
    colours = {each.text: colour for each, colour in COLOURS.items() if each in advice.answers}
    scale = {'domain': list(colours), 'range': list(colours.values())}
    colour = {'field': 'criterion', 'type': 'nominal', 'title': None, 'scale': scale, 'legend': _BELOW}
    dots = 'dots: closed-loop trials with the interval of their share; ' if advice.tried else ''
    return Chart(
        'share',
        'How many trials are within the tolerance',
        'Line: odometry, by draws of one drive; dotted: the same in closed form, of quantisation alone, where the axis '
        f'that needs most counts decides; {dots}diamonds: odometry '
        'with the encoders of the table, in the test where they are worst; grey: the share asked for.',
        {
            'layer': [
                required,
                _closed_form_line(),
                _drawn_line(colour),
                *_trial_dots(advice, colour),
                _encoder_diamonds(),
            ]
        },
    )


def _drawn_line(colour: Spec) -> Spec:
    return {
        'data': {'name': 'curves'},
        'transform': [_OF_TEST],
        'params': [ZOOM],
        'mark': {'type': 'line', 'clip': True},
        'encoding': {'x': _COUNTS, 'y': _SHARE, 'color': colour},
    }


def _closed_form_line() -> Spec:
    return {
        'data': {'name': 'closed'},
        'transform': [_OF_TEST],
        'mark': {'type': 'line', 'strokeDash': [2, 3], 'color': COLOURS[Criterion.ODOMETRY], 'clip': True},
        'encoding': {'x': _COUNTS, 'y': _SHARE},
    }


def _trial_dots(advice: Advice, colour: Spec) -> List[Spec]:
    """Return the intervals and the dots on them; nothing without trials."""
    if not advice.tried:
        return []
    of_test = {'data': {'name': 'trials'}, 'transform': [_OF_TEST]}
    ends = {'x': _COUNTS, 'y': {**_SHARE, 'field': 'low'}, 'y2': {'field': 'high'}, 'color': colour}
    tips = _tips(encoder='', criterion='', trials='trials within')
    dots = {'x': _COUNTS, 'y': _SHARE, 'color': colour, 'tooltip': tips}
    return [
        {**of_test, 'mark': {'type': 'rule', 'clip': True}, 'encoding': ends},
        {**of_test, 'mark': {'type': 'point', 'filled': True, 'size': 60, 'clip': True}, 'encoding': dots},
    ]


def _encoder_diamonds() -> Spec:
    colour = COLOURS[Criterion.ODOMETRY]
    return {
        'data': {'name': 'encoders'},
        'mark': {'type': 'point', 'shape': 'diamond', 'size': 60, 'color': colour, 'clip': True},
        'encoding': {'x': _COUNTS, 'y': _SHARE, 'tooltip': _tips(encoder='', counts='', trials='draws within')},
    }


def _error_chart(advice: Advice) -> Chart:
    error = {'field': 'error', 'type': 'quantitative', 'scale': {'type': 'log'}, 'title': 'error [mm, degrees]'}
    lines = {
        'data': {'name': 'errors'},
        'transform': [_OF_TEST, {'filter': 'datum.axis === axis'}],
        'params': [ZOOM],
        'mark': {'type': 'line', 'clip': True},
        'encoding': {
            'x': _COUNTS,
            'y': error,
            'strokeDash': {'field': 'line', 'type': 'nominal', 'title': None, 'legend': _BELOW},
        },
    }
    return Chart(
        'error',
        "Odometry's error against the counts",
        'What half, the required share, and 95 % of the draws do not exceed; grey: the tolerance.',
        {'layer': [_tolerance_rule(advice, error), lines]},
    )


def _budget_chart(advice: Advice) -> Chart:
    rms = {'field': 'rms', 'type': 'quantitative', 'title': 'rms [mm, degrees]'}
    of_criterion = [_OF_CRITERION] if _has_truth(advice) else []
    bars = {
        'data': {'name': 'budget'},
        'transform': [_OF_TEST, {'filter': 'datum.axis === axis'}, *of_criterion],
        'mark': 'bar',
        'encoding': {
            'x': {'field': 'encoder', 'type': 'ordinal', 'sort': {'field': 'counts'}, 'title': _COUNTS['title']},
            'y': rms,
            'color': {
                'field': 'cause',
                'type': 'nominal',
                'title': None,
                'scale': {'range': CAUSES},
                'sort': None,  # as they come: the legend has those of the chosen criterion
                'legend': {'orient': 'bottom', 'columns': 2},
            },
            'tooltip': _tips(encoder='', cause='', mean='', deviation='standard deviation'),
        },
    }
    return Chart(
        'budget',
        'Error budget',
        'Height: root mean square error; each cause has its part of the mean square. Grey: the tolerance.',
        {'layer': [bars, _tolerance_rule(advice, {**rms, 'field': 'error'}), *_without_budget(advice)]},
    )


def _without_budget(advice: Advice) -> List[Spec]:
    """Return a text in place of bars for tests with too few trials at the goal; nothing without trials."""
    if not _has_truth(advice):
        return []
    tests = {tried.test for tried in advice.tried} - {tried.test for tried in advice.tried if tried.truth}
    return [
        {
            'data': {'values': [{'test': test, 'criterion': Criterion.TRUTH.value} for test in sorted(tests)]},
            'transform': [_OF_TEST, _OF_CRITERION],
            'mark': {'type': 'text', 'text': 'too few trials came to the goal', 'color': GREY},
        }
    ]


def _tolerance_rule(advice: Advice, error: Spec) -> Spec:
    """Return the tolerance of the chosen axis as a line across."""
    tolerances = [
        {'axis': axis, 'error': float(tolerance * scale)}
        for axis, tolerance, scale in zip(AXES, advice.requirement.tolerances, TO_SHOWN)
    ]
    return {
        'data': {'values': tolerances},
        'transform': [{'filter': 'datum.axis === axis'}],
        'mark': _REQUIRED,
        'encoding': {'y': error},
    }


def _tips(**fields: str) -> List[Dict[str, str]]:
    return [{'field': field, 'title': title or field} for field, title in fields.items()]
