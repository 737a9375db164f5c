"""The report's interactive charts: every trial's final error, how they are spread, and the path of one trial."""

from __future__ import annotations

from typing import Dict, List, Optional

from markupsafe import Markup
from matplotlib.colors import to_hex

from diff_encoder_sim.analysis.charts import Chart, Choice, Look, Option, charts_html
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_text, ppr_values
from diff_encoder_sim.analysis.figures.error_series import SERIES
from diff_encoder_sim.analysis.figures.style import ppr_colours
from diff_encoder_sim.analysis.first_trials import sample_text
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, X, Y
from diff_encoder_sim.analysis.report.chart_data import closed_form_rows, error_rows, spread_rows, trial_rows
from diff_encoder_sim.analysis.report.chart_paths import Floor, floors_of, map_rows, mark_rows, path_indices, path_rows
from diff_encoder_sim.analysis.report.specs.curve_spec import curve_spec
from diff_encoder_sim.analysis.report.specs.distribution_spec import distribution_spec
from diff_encoder_sim.analysis.report.specs.path_spec import path_spec
from diff_encoder_sim.analysis.report.specs.scatter_spec import scatter_spec
from diff_encoder_sim.analysis.table_keys import cell_text, setup_text

PATH = 'path'

SYMBOLS = {'o': '●', 's': '■', 'D': '◆', '^': '▲', 'v': '▼'}

# So many tests with their parameters are buttons; more are a list.
MOST_BUTTONS = 6


def trial_charts(dataset: Dataset, shown: Dataset) -> Optional[Markup]:
    """Return the charts with their data and choices; None where no trial ended with a pose.

    Args:
        dataset: all trials, whose spreads are drawn.
        shown: those with points and paths of their own: of many, some.
    """
    errors = error_rows(shown)
    if not errors:
        return None
    spreads, with_path = spread_rows(dataset), path_indices(shown)
    floors = floors_of(shown, with_path)
    data = {
        'trials': trial_rows(shown),
        'errors': errors,
        'spreads': spreads,
        'closed_form': closed_form_rows(dataset),
        'paths': path_rows(shown, with_path, floors),
        'marks': mark_rows(dataset, list(floors)),
        'maps': map_rows(dataset, list(floors)),
    }
    colours = {label: to_hex(colour) for label, colour in ppr_colours(dataset.encoders()).items()}
    charts = [*_error_charts(colours, sample_text(shown, dataset))]
    if spreads:
        charts.append(_curve_chart(ppr_values(dataset.encoders())))
    if with_path:
        charts.append(_path_chart(shown, colours, floors, is_all=len(with_path) == len(dataset.trials)))
    sources = sorted({row['source'] for row in errors})
    return charts_html(
        charts, data, [*_choices(dataset, colours, sources), *(_of_path(shown, with_path) if with_path else [])]
    )


def _error_charts(colours: Dict[str, str], sample: str) -> List[Chart]:
    names = {label: ppr_text(label) for label in colours}
    click, begin = 'A click on a point shows its path.', f'{sample}: ' if sample else ''
    return [
        Chart(
            'scatter',
            'Final position errors',
            f'{begin}x and y along the map; shaded: within {X.tolerance:g} m. {click}',
            scatter_spec(colours),
            'trials',
        ),
        Chart(
            'distributions',
            'Distributions',
            f'{sample or "Every trial"}, with median and quartiles; shaded: within {Y.tolerance:g} m or '
            f'{YAW.tolerance:g} degrees. {click}',
            distribution_spec(colours, names),
            'tables',
        ),
    ]


def _curve_chart(pprs: List[float]) -> Chart:
    description = (
        'Standard deviation with its 95 % interval; dashed: the closed form of quantisation alone, for stops that '
        'differ by more than a pulse. Hollow: real encoders.'
    )
    return Chart('curve', 'Error against resolution', description, curve_spec(pprs), 'encoders')


def _path_chart(dataset: Dataset, colours: Dict[str, str], floors: Dict[str, Floor], is_all: bool) -> Chart:
    description = 'Grey: the true path; in the colour of the encoder: /odom. Circle: start; cross: goal.'
    if not is_all:
        description += ' Of trials with a bag, the first of each cell.'
    tests = [trial.test for trial in dataset.trials]
    return Chart(PATH, 'Path of the trial', description, path_spec(colours, floors, tests), 'trials')


def _choices(dataset: Dataset, colours: Dict[str, str], sources: List[int]) -> List[Choice]:
    setups = [Option(place, setup_text(*setup)) for place, setup in enumerate(dataset.setups())]
    first = [place for place in (0, 2) if place in sources] or sources[:1]
    return [
        Choice('setup', 'Test', setups, 0, Look.BUTTONS if len(setups) <= MOST_BUTTONS else Look.LIST),
        Choice(
            'encoders',
            'Encoder',
            [Option(label, ppr_text(label), colour) for label, colour in colours.items()],
            list(colours),
            Look.BOXES,
        ),
        Choice('sources', 'Pose', [_source(place) for place in sources], first, Look.BOXES),
        Choice(
            'quantity',
            'Distributions and curve of',
            [Option(quantity.axis, quantity.axis) for quantity in QUANTITIES],
            Y.axis,
            Look.BUTTONS,
        ),
    ]


def _source(place: int) -> Option:
    series = SERIES[place]
    return Option(place, series.label, series.colour, SYMBOLS[series.marker])


def _of_path(dataset: Dataset, shown: List[int]) -> List[Choice]:
    setups = dataset.setups()
    options = []
    for index in shown:
        trial = dataset.trials[index]
        within = setups.index((trial.test, trial.varied))
        options.append(Option(index, f'{cell_text(trial.cell)}, trial {trial.trial}', within=within))
    scales = [Option('fit', 'stretched to fit'), Option('equal', 'true to scale')]
    return [
        Choice('trial', 'Path of', options, shown[0], Look.LIST, 'setup', PATH),
        Choice('scale', 'Path chart', scales, 'fit', Look.BUTTONS),
    ]
