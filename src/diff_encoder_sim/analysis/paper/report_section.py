"""The paper's numbers beside those of one or two datasets: tables for files and the report, and a few sentences."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.dataset import Dataset, TrialData, Varied, distinct
from diff_encoder_sim.analysis.final_errors import final_errors
from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE
from diff_encoder_sim.analysis.paper.claims import ClaimResult, check_claims
from diff_encoder_sim.analysis.paper.comparison import (
    HALF_A_DIGIT,
    ComparedCell,
    PaperComparison,
    Readings,
    Score,
    better_fit,
    compare_with_paper,
    score,
    scores_by_family,
)
from diff_encoder_sim.analysis.paper.paper_cells import (
    ERRATA,
    STATISTICS,
    TRIALS,
    PaperCell,
    errata_of,
    load_paper_cells,
    of_paper,
)
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.sample_statistics import mean_interval
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_text, varied_keys, varied_texts
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

SETS = 200_000
# Half of the sets are Gaussian; the others are Student's t with so many degrees of freedom, as errors with outliers.
HEAVY_TAIL_FREEDOM = 3
# How far a set's standard deviation may be from the printed one, relative, where rounding does not allow more.
STD_TOLERANCE = 0.02
FEWEST_SETS = 50  # that must agree, for a quantile to be known


class ImpliedMean(NamedTuple):
    """The centre of the distribution that 30 trials are drawn from, in their unit."""

    value: float  # the median of what is possible
    low: float  # 95 % of what is possible
    high: float


class MeanEstimator:
    """Estimates a mean from a sample's printed statistics.

    Every set of simulated values is shifted and stretched so that its minimum and maximum are the printed ones.
    Sets that then have the printed standard deviation and number within tolerance too are draws of the
    posterior, with a flat prior of centre and logarithm of scale. The numbers themselves choose between
    Gaussian errors and such with heavy tails; a skewed distribution is not considered.
    """

    def __init__(self, sets: int = SETS, trials: int = TRIALS) -> None:
        """Simulate the sets, the same in every run."""
        rng = np.random.default_rng(0)
        gaussian = rng.standard_normal((sets // 2, trials))
        heavy = rng.standard_t(HEAVY_TAIL_FREEDOM, (sets // 2, trials))
        self._values = np.concatenate((gaussian, heavy))
        self._min, self._max = self._values.min(axis=1), self._values.max(axis=1)
        self._std = self._values.std(axis=1, ddof=1)
        self._rounding = rng.uniform(-HALF_A_DIGIT, HALF_A_DIGIT, (2, len(self._values)))

    def estimate(self, printed: Dict[str, float], tolerance: float) -> Optional[ImpliedMean]:
        """Return the mean behind a sample; None where hardly any set has its statistics.

        Args:
            printed: by the names of `paper_cells.STATISTICS`.
            tolerance: which `pct_within` counts by, in the unit of the other statistics.
        """
        least, largest = printed['min'] + self._rounding[0], printed['max'] + self._rounding[1]
        scale = np.maximum(largest - least, 0.0) / (self._max - self._min)
        centre = least - scale * self._min
        allowed = max(HALF_A_DIGIT, STD_TOLERANCE * printed['std'])
        agree = np.flatnonzero(np.abs(scale * self._std - printed['std']) <= allowed)
        values = centre[agree, None] + scale[agree, None] * self._values[agree]
        within = np.count_nonzero(np.abs(values) <= tolerance, axis=1)
        agree = agree[within == round(printed['pct_within'] / 100.0 * values.shape[1])]
        if len(agree) < FEWEST_SETS:
            return None
        tail = (1.0 - LEVEL) / 2.0
        return ImpliedMean(*(float(value) for value in np.quantile(centre[agree], (0.5, tail, 1.0 - tail))))


NOTE = (
    'Final pose minus goal; in brackets 95 %. The paper prints no means: its min, max, standard deviation and per cent '
    'within imply them, if errors scatter evenly about the mean. –: not known, or an erratum.'
)

PaperRow = Dict[Quantity, Dict[str, float]]  # what is printed, by statistic


def mean_table(datasets: Dict[str, Dataset]) -> Table:
    """Build the table of means of all cells that the paper and a dataset have, with a column for each dataset by name.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
    """
    labels = ['ours'] if len(datasets) == 1 else list(datasets)
    columns = [Column('source', 'source'), Column('cell', 'cell')]
    columns += [
        Column(f'{quantity.name}_{whose}', whose, quantity.head)
        for quantity in QUANTITIES
        for whose in ('paper', *labels)
    ]
    estimator, ours = MeanEstimator(), [dataset.cells() for dataset in datasets.values()]
    rows: List[List[Entry]] = []
    for (source, *test_and_ppr), printed in _paper_rows().items():
        for cell in distinct(one for cells in ours for one in cells if [one.test, one.ppr] == test_and_ppr):
            entries: List[Entry] = [TOPIC_OF_SOURCE[source], cell_text(cell)]
            for quantity in QUANTITIES:
                entries.append(_paper_text(estimator, printed[quantity], quantity))
                entries += [_our_text(final_errors(cells.get(cell, []), source, quantity)) for cells in ours]
            rows.append(entries)
    return Table('paper_means', "Means that the paper's numbers imply, and ours", columns, rows, [NOTE])


def _paper_rows() -> Dict[Tuple[PoseSource, str, str], PaperRow]:
    rows: Dict[Tuple[PoseSource, str, str], PaperRow] = defaultdict(lambda: {quantity: {} for quantity in QUANTITIES})
    for cell in load_paper_cells():
        if not errata_of(cell):
            rows[cell.source, cell.test, cell.ppr][cell.quantity][cell.statistic] = cell.value
    return rows


def _paper_text(estimator: MeanEstimator, printed: Dict[str, float], quantity: Quantity) -> str:
    if len(printed) < len(STATISTICS):
        return '–'
    implied = estimator.estimate(printed, quantity.tolerance)
    return '–' if implied is None else _text(*implied)


def _our_text(values: np.ndarray) -> str:
    return '–' if len(values) < 2 else _text(float(values.mean()), *mean_interval(values))


def _text(value: float, low: float, high: float) -> str:
    return f'{value:.3f} ({low:.3f} to {high:.3f})'


HEADS = {'min': 'min', 'max': 'max', 'std': 'std. dev.', 'pct_within': '% within'}
PRINTED = 'printed'  # in the paper; a campaign may be called paper
DIFFERS, ERRATUM, CALIBRATED = '≠', '†', '*'
LEGEND = (
    f'{DIFFERS} contradicted: chance alone does not explain the difference (p < 0.05 after Holm, over all cells of the '
    f"source and test). {ERRATUM} the paper's number is among its errata. {CALIBRATED} the slip of "
    f'config/campaigns/paper.yaml was fitted to this number. Neither is tested.'
)
INTERVAL_LEGEND = (
    "In brackets our 95 % interval; of min and max, where those of the paper's number of trials lie (inf: too few of "
    'ours for a bound).'
)


def cell_tables(readings: Readings) -> List[Table]:
    """Build tables 4 to 6 with the paper's numbers beside ours, of one reading with its intervals."""
    is_single = len(readings) == 1
    labels = ['ours'] if is_single else list(readings)
    columns = [Column('cell', 'cell'), Column('quantity', 'error')]
    columns += [
        Column(f'{statistic}_{whose}', whose, HEADS[statistic])
        for statistic in STATISTICS
        for whose in (PRINTED, *labels)
    ]
    notes = [INTERVAL_LEGEND, LEGEND] if is_single else [LEGEND]
    tables = []
    for number in sorted({one.paper.table for cells in readings.values() for one in cells}):
        by_reading = [{one.paper: one for one in cells if one.paper.table == number} for cells in readings.values()]
        printed = distinct(paper for of_reading in by_reading for paper in of_reading)
        title = f'Table {number} of the paper ({TOPIC_OF_SOURCE[printed[0].source]}) and ours'
        tables.append(Table(f'paper_table{number}', title, columns, _cell_rows(printed, by_reading), notes))
    return tables


def all_cells_table(readings: Readings) -> Table:
    """List every compared number of each reading, with its tests."""
    names = ('campaign', 'table', 'source', 'test', 'ppr', 'quantity', 'statistic')
    numbers = ('paper', 'ours', 'low', 'high', 'p', 'p_holm')
    columns = [Column(name, name) for name in (*names, *numbers, 'left_out')]
    rows = [_all_entries(label, one) for label, cells in readings.items() for one in cells]
    return Table('paper_cells', 'Cells of the paper and ours', columns, rows, [])


def resolution_table(comparison: PaperComparison) -> Table:
    """Build table 3 for this robot, beside the paper's."""
    linear, angle = 'travel per pulse [mm]', 'rotation, one pulse of both wheels [deg]'
    columns = [
        Column('ppr', 'PPR'),
        Column('linear_paper', 'paper', linear),
        Column('linear_ours', 'computed', linear),
        Column('angle_paper', 'paper', angle),
        Column('angle_ours', 'computed', angle),
    ]
    rows: List[List[Entry]] = [
        [
            f'{computed.ppr:g}',
            Number(printed and 1e3 * printed.linear_m, 2),
            Number(1e3 * computed.linear_m, 2),
            Number(printed and math.degrees(printed.angle_rad), 3),
            Number(math.degrees(computed.two_wheel_angle_rad), 3),
        ]
        for computed, printed in comparison.resolutions
    ]
    return Table('paper_table3', 'Table 3 of the paper, printed and computed', columns, rows, [])


def errata_table() -> Table:
    """List the errors in the paper itself."""
    columns = [Column(name, name) for name in ('where', 'printed', 'right', 'why')]
    rows: List[List[Entry]] = [[one.where, one.printed, one.right, one.why] for one in ERRATA]
    return Table('errata', 'Errata of the paper', columns, rows, [])


def _cell_rows(printed: Sequence[PaperCell], by_reading: Sequence[Dict[PaperCell, ComparedCell]]) -> List[List[Entry]]:
    by_row: Dict[Tuple[str, Quantity], Dict[str, PaperCell]] = {}
    for paper in printed:
        by_row.setdefault((f'{paper.test}, {paper.ppr} PPR', paper.quantity), {})[paper.statistic] = paper
    rows: List[List[Entry]] = []
    for (cell, quantity), of_row in by_row.items():
        entries: List[Entry] = [cell, quantity.head]
        for statistic in STATISTICS:
            entries += _texts(of_row.get(statistic), by_reading)
        rows.append(entries)
    return rows


def _texts(paper: Optional[PaperCell], by_reading: Sequence[Dict[PaperCell, ComparedCell]]) -> List[str]:
    """Format the paper's number and that of each reading, with marks."""
    if paper is None:
        return ['–'] * (1 + len(by_reading))
    decimals = 1 if paper.statistic == 'pct_within' else 3
    found = [of_reading.get(paper) for of_reading in by_reading]
    mark = f' {ERRATUM}' if errata_of(paper) else ''
    return [
        f'{paper.value:.{decimals}f}{mark}',
        *(_our_text_against_paper(one, decimals, len(found) == 1) for one in found),
    ]


def _our_text_against_paper(one: Optional[ComparedCell], decimals: int, has_interval: bool) -> str:
    if one is None:
        return '–'
    ours = f'{one.agreement.ours:.{decimals}f}'
    if has_interval:
        low, high = one.agreement.interval
        ours += f' ({low:.{decimals}f} to {high:.{decimals}f})'
    marks = [DIFFERS] * one.is_contradicted + [CALIBRATED] * one.is_calibrated
    return ' '.join([ours, *marks])


def _all_entries(label: str, one: ComparedCell) -> List[Entry]:
    """Return an entry for each column of `all_cells_table`."""
    paper, found = one.paper, one.agreement
    names = (f'{paper.table}', paper.source.value, paper.test, paper.ppr, paper.quantity.name, paper.statistic)
    numbers = (paper.value, found.ours, *found.interval, found.p_value, one.p_adjusted)
    left_out = [*one.errata, *(['calibrated'] if one.is_calibrated else [])]
    return [label, *names, *(Number(value, 4) for value in numbers), ' '.join(left_out)]


HEADS_SCORE_TABLES = {
    'compared': 'compared',
    'inside': 'inside',
    'alone': 'agree alone',
    'in_family': 'agree in family',
}
NOTES = (
    (
        'Inside: the paper\'s number lies in our 95 % interval (in brackets in "Cells side by side"). That leaves out '
        'the sampling error of its own 30 trials: of equal robots, five in six standard deviations would be inside.'
    ),
    (
        'Alone: p at least 0.05 with the sampling error of both (standard deviation: F-test, careful where our '
        "tails are heavy; % within: Fisher's exact test; min and max: ranks, and beyond all of ours an exponential "
        'tail). Of equal robots, up to one in twenty would not agree.'
    ),
    (
        'In family: the cells of a row of this table are judged together (p at least 0.05 after Holm). Of equal '
        'robots, one row in twenty would have a cell that does not agree.'
    ),
    (
        'Not counted are cells that the errata affect, the numbers that config/campaigns/paper.yaml was fitted to, and '
        'minima and maxima that nothing can be concluded from. Cells are dependent: x, y and heading of a cell are '
        'of the same trials, so are its four statistics, and equal trials have equal noise with each encoder.'
    ),
)
_ALL = 'all'


def score_table(readings: Readings) -> Table:
    """Count the cells that agree by source and test, with a group of columns for each of several readings."""
    columns = [Column('source', 'source'), Column('test', 'test')]
    for label in readings:
        group = label if len(readings) > 1 else ''
        columns += [Column(f'{group}_{name}'.lstrip('_'), head, group) for name, head in HEADS_SCORE_TABLES.items()]
    by_family = [scores_by_family(cells) for cells in readings.values()]
    rows: List[List[Entry]] = []
    for source, test in distinct(key for scores in by_family for key in scores):
        rows.append([TOPIC_OF_SOURCE[source], test, *_entries([scores.get((source, test)) for scores in by_family])])
    rows.append([_ALL, '', *_entries([score(cells) for cells in readings.values()])])
    return Table('paper_scores', 'Cells of the paper that agree with ours', columns, rows, list(NOTES))


def score_text(label: str, cells: List[ComparedCell]) -> str:
    """Return the total score of a reading in a sentence."""
    total = score(cells)
    return (
        f'{label}: of {total.compared} cells of the paper {total.inside} are inside our 95 % interval; {total.alone} '
        f'agree, each alone; {total.in_family} agree in their families.'
    )


def fit_texts(readings: Readings) -> List[str]:
    """Compare the first reading with each other in a sentence; they should have equal trials."""
    if not readings:
        return []
    (first, cells), *others = readings.items()
    return [_fit_text(first, cells, label, other) for label, other in others]


def _fit_text(first: str, first_cells: List[ComparedCell], second: str, second_cells: List[ComparedCell]) -> str:
    fit = better_fit(first_cells, second_cells)
    more = first if fit.only[0] > fit.only[1] else second
    if fit.grouped_p < SIGNIFICANCE:
        conclusion = f'{more} fits the paper better'
    elif fit.only[0] == fit.only[1]:
        conclusion = f'{first} and {second} fit the paper equally well'
    else:
        conclusion = f'{more} fits the paper better, but by no more than chance explains'
    return (
        f'Over equal trials, {conclusion}: {fit.only[0]} cells agree with {first} alone, {fit.only[1]} with {second} '
        f'alone (p {fit.grouped_p:.2g} by the signed ranks of the tests and encoders, whose cells share their trials; '
        f'McNemar over cells, as if they were independent: p {fit.mcnemar_p:.2g}).'
    )


def _entries(scores: Sequence[Optional[Score]]) -> List[Entry]:
    return [Number(value, 0) for each in scores for value in (each or [None] * len(HEADS_SCORE_TABLES))]


class PaperSection(NamedTuple):
    """What is shown of the paper, beside each reading of it: a dataset, or a set of its varied parameters."""

    scores: Table
    texts: List[str]  # the scores in sentences, and which reading fits better
    claims: Dict[str, List[ClaimResult]]  # by reading
    cells: List[Table]
    all_cells: Table  # too long to show
    errata: Table
    has_enough_trials: bool  # as many as the paper has: with few, nearly everything agrees


def paper_section(datasets: Sequence[Dataset]) -> Optional[PaperSection]:
    """Compare datasets with the paper; None where there is but one and it has no cell of the paper, or another robot.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read, or one of several has no cell of the paper.
    """
    datasets = [of_paper(dataset) for dataset in datasets]
    comparisons = [compare_with_paper(dataset) for dataset in datasets]
    if len(datasets) == 1 and not comparisons[0].rows:
        return None
    for dataset, comparison in zip(datasets, comparisons):
        if not comparison.rows:
            raise ConfigError(
                f'{dataset.folder or dataset.title}: has no cell of the paper; '
                f"expected the paper's robot and tests (SL, SMT or DLD, navigated) with 40, 90, 1024 or 4096 PPR"
            )
    names = _names(datasets)
    readings = _readings(names, comparisons)
    return PaperSection(
        score_table(readings),
        [*(score_text(label, cells) for label, cells in readings.items()), *_fit_texts(names, datasets)],
        _claims(names, datasets, readings),
        [resolution_table(comparisons[0]), *cell_tables(readings), mean_table(dict(zip(names, datasets)))],
        all_cells_table(readings),
        errata_table(),
        all(one.trials >= TRIALS for cells in readings.values() for one in cells),
    )


def _readings(names: Sequence[str], comparisons: Sequence[PaperComparison]) -> Readings:
    """Return the compared cells of each reading."""
    return {
        _label(name, varied): [one for one in comparison.rows if one.cell.varied == varied]
        for name, comparison in zip(names, comparisons)
        for varied in distinct(one.cell.varied for one in comparison.rows)
    }


def _fit_texts(names: Sequence[str], datasets: Sequence[Dataset]) -> List[str]:
    """Say which reading fits better by the trials that all have: fewer trials contradict less."""
    common = set.intersection(*({_key(trial) for trial in dataset.trials} for dataset in datasets))
    equal = [
        dataset._replace(trials=[trial for trial in dataset.trials if _key(trial) in common]) for dataset in datasets
    ]
    return fit_texts(_readings(names, [compare_with_paper(dataset) for dataset in equal]))


def _key(trial: TrialData) -> Tuple[str, str, int]:
    return trial.test, trial.ppr, trial.trial


def _claims(names: Sequence[str], datasets: Sequence[Dataset], readings: Readings) -> Dict[str, List[ClaimResult]]:
    """Return the results of all claims by reading."""
    claims: Dict[str, List[ClaimResult]] = {label: [] for label in readings}
    for name, dataset in zip(names, datasets):
        for result in check_claims(dataset):
            claims.setdefault(_label(name, result.varied), []).append(result)
    return {label: claims[label] for label in readings}


def _names(datasets: Sequence[Dataset]) -> List[str]:
    """Return names that differ: the titles, or else the folders, or else numbers; none where parameters tell enough."""
    if len(datasets) == 1 and varied_keys(datasets[0]):
        return ['']
    titles = [dataset.title for dataset in datasets]
    folders = [str(dataset.folder) for dataset in datasets]
    numbers = [f'{title} ({number})' for number, title in enumerate(titles, start=1)]
    return next(names for names in (titles, folders, numbers) if len(set(names)) == len(names))


def _label(name: str, varied: Varied) -> str:
    return ', '.join(filter(None, [name, *varied_texts(varied)]))
