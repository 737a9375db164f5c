"""Interactive charts of the report: final errors of trials, their distributions and spread, and the path of a trial."""

from __future__ import annotations

import functools
from typing import Any, Dict, List, Optional, Sequence, Tuple

import altair as alt
from markupsafe import Markup

from diff_encoder_sim.analysis.charts import drawings, frames
from diff_encoder_sim.analysis.charts.chart_page import Chart, Choice, Option, charts_html, zoomed
from diff_encoder_sim.analysis.encoder_labels import ppr_text, ppr_values
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, X, Y
from diff_encoder_sim.analysis.results_table import Results, encoders, sample_text
from diff_encoder_sim.base.deferred import pandas as pd

MOST_BUTTONS = 6  # more setups become a list
FIRST_SHOWN = (drawings.LABELS[0], drawings.LABELS[2])

SHOWN = 'datum.setup === setup && indexof(encoders, datum.encoder) >= 0 && indexof(sources, datum.series) >= 0'
OF_TEST = 'datum.test === floor.test'
UNIT = f'{ {quantity.axis: quantity.unit for quantity in QUANTITIES} }[quantity]'
TOLERANCE = f'{{{", ".join(f"{quantity.axis}: {quantity.tolerance}" for quantity in QUANTITIES)}}}[quantity]'
CLICK = 'Click a point to show its path.'
CURVE_TEXT = (
    'Standard deviation with its 95 % interval; dashed: closed form of quantisation, for final poses that differ by '
    'more than a pulse. Hollow: real encoders.'
)


def trial_charts(results: Results, shown: pd.DataFrame) -> Optional[Markup]:
    """Return the charts with their data and choices; None if no trial has a final pose.

    Only trials of `shown` have points and paths; `data-choose` of the page refers to its index.
    """
    errors = frames.error_rows(shown)
    if errors.empty:
        return None
    colours, sample = drawings.encoder_colours(encoders(results.trials)), sample_text(shown, results.trials)
    paths, stds = frames.with_paths(shown), frames.spread_rows(results.trials)
    chosen, named = 'false' if paths.empty else 'datum.trial === trial', frames.trial_rows(shown)
    points = functools.partial(drawings.error_points, colours=colours, trials=named, chosen=chosen)
    rows = alt.Chart(errors).transform_filter(SHOWN)
    scatter = drawings.xy_errors(rows, points)
    scatter.layer[-1] = zoomed(scatter.layer[-1])
    values = rows.transform_calculate(value='datum[quantity]', slot='indexof(sources, datum.series)')
    values, names = values.transform_filter('isValid(datum.value)'), {label: ppr_text(label) for label in colours}
    distributions = drawings.distributions(values, points, names, UNIT, TOLERANCE, 'length(sources)')
    distributions.layer[2] = zoomed(distributions.layer[2], ['y'])
    within_x = f'{sample + ": " if sample else ""}x and y along the map; shaded: within {X.tolerance:g} m. {CLICK}'
    within = (
        f'{sample or "Every trial"}, with median and quartiles; shaded: within {Y.tolerance:g} m or '
        f'{YAW.tolerance:g} degrees. {CLICK}'
    )
    charts = [
        Chart('scatter', 'Final position errors', within_x, scatter, 'trials'),
        Chart('distributions', 'Distributions', within, distributions, 'tables'),
    ]
    if not stds.empty:
        of_quantity = 'datum.quantity === quantity'
        measured = alt.Chart(stds).transform_filter(f'{SHOWN} && {of_quantity}')
        closed_form = alt.Chart(frames.closed_form_rows(results))
        closed_form = closed_form.transform_filter(f'datum.setup === setup && {of_quantity}')
        curve = drawings.spreads(measured, closed_form, ppr_values(encoders(results.trials)), UNIT)
        curve.layer[0] = zoomed(curve.layer[0])
        charts.append(Chart('curve', 'Error against resolution', CURVE_TEXT, curve, 'encoders'))
    if not paths.empty:
        charts.append(_path_chart(results, paths, colours, named))
    series = [one for one in drawings.SERIES if (errors.series == one[0]).any()]
    return charts_html(charts, _choices(results.trials, colours, series, paths))


def _path_chart(results: Results, paths: pd.DataFrame, colours: Dict[str, str], named: pd.DataFrame) -> Chart:
    floors = frames.floor_rows(paths, results)
    tests = list(floors.index)
    drawing = drawings.path_chart(
        alt.Chart(frames.path_rows(paths, floors)).transform_filter('datum.trial === trial'),
        alt.Chart(frames.mark_rows(results, tests)).transform_filter(OF_TEST),
        alt.Chart(frames.map_rows(results, tests)).transform_filter(OF_TEST),
        colours,
        drawings.floor_domains({key: f'floor.{key}' for key in floors}, "scale === 'equal'"),
        named,
    )
    drawing.layer[0] = zoomed(drawing.layer[0])
    floor_of = {str(trial): {'test': test, **floors.loc[test]} for trial, test in paths['test'].items()}
    floor = [alt.param(name='floor_of', value=floor_of), alt.param(name='floor', expr='floor_of[trial]')]
    description = 'Grey: the true path; in the colour of the encoder: /odom. Circle: start; cross: goal.'
    if len(paths) < len(results.trials):
        description += ' Of trials with a bag, the first of each cell.'
    return Chart('path', 'Path of the trial', description, drawing.add_params(*floor), 'trials')


def _choices(
    trials: pd.DataFrame, colours: Dict[str, str], series: Sequence[Tuple[str, str, str, str]], paths: pd.DataFrame
) -> List[Choice]:
    setups = [Option(setup, setup) for setup in trials['setup'].unique()]
    of_encoder = [Option(label, ppr_text(label), colour) for label, colour in colours.items()]
    poses = [Option(label, label, colour, symbol) for label, colour, _, symbol in series]
    first: List[Any] = [pose.value for pose in poses if pose.value in FIRST_SHOWN] or [poses[0].value]
    axes = [Option(quantity.axis, quantity.axis) for quantity in QUANTITIES]
    choices = [
        Choice('setup', 'Test', setups, setups[0].value, 'radio' if len(setups) <= MOST_BUTTONS else 'select'),
        Choice('encoders', 'Encoder', of_encoder, list(colours), 'checkbox'),
        Choice('sources', 'Pose', poses, first, 'checkbox'),
        Choice('quantity', 'Distributions and curve of', axes, Y.axis, 'radio'),
    ]
    if not paths.empty:
        options = [
            Option(index, f'{trial["cell"]}, trial {trial["trial"]}', within=trial['setup'])
            for index, trial in paths.iterrows()
        ]
        scales = [Option('fit', 'stretched to fit'), Option('equal', 'true to scale')]
        choices.append(Choice('trial', 'Path of', options, options[0].value, 'select', 'setup', 'path'))
        choices.append(Choice('scale', 'Path chart', scales, 'fit', 'radio'))
    return choices
