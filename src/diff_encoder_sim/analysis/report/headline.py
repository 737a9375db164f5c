"""The headline: with which encoders enough trials end within the tolerance."""

from __future__ import annotations

from typing import Callable, Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, Varied
from diff_encoder_sim.analysis.encoder_labels import encoders_text, enumeration, is_real, ppr_value
from diff_encoder_sim.analysis.quantities import LEVEL, REQUIRED_FRACTION
from diff_encoder_sim.analysis.table_keys import varied_texts
from diff_encoder_sim.analysis.within_tolerance import (
    COMPARED_POSES,
    TOLERANCE_TEXT,
    ComparedPose,
    FractionWithin,
    Sufficiency,
    fewest_trials,
)
from diff_encoder_sim.drives.trial_definition import Outcome


class SummaryRow(NamedTuple):
    """One test with one set of parameters, by one final pose."""

    test: str
    varied: Varied
    pose: ComparedPose
    fractions: Dict[str, Optional[FractionWithin]]  # by encoder, ascending; None without a final pose


def summary_rows(dataset: Dataset) -> List[SummaryRow]:
    """Count the trials within tolerance: by test and set of parameters, a row for each of `COMPARED_POSES`."""
    cells, labels = dataset.cells(), dataset.encoders()
    rows = []
    for test, varied in dataset.setups():
        trials = {label: cells.get(CellKey(test, label, varied)) for label in labels}
        for pose in COMPARED_POSES:
            fractions = {label: pose.fraction(of_cell) for label, of_cell in trials.items() if of_cell}
            rows.append(SummaryRow(test, varied, pose, fractions))
    return rows


# So many tests, counted with their sets of parameters, are named; more are only counted.
MOST_NAMED = 3

NOTHING = 'No trial ended with a pose: nothing can be concluded.'


class Headline(NamedTuple):
    """What the dataset shows about the encoders."""

    statement: str  # what is listed by pose
    by_source: Dict[str, str]  # by text of the final pose
    failures: str  # empty where all trials succeeded

    @property
    def text(self) -> str:
        """Return the headline as lines for the terminal."""
        width = max(map(len, self.by_source), default=0)
        lines = [f'  {source + ":":{width + 1}} {text}' for source, text in self.by_source.items()]
        return '\n'.join([self.statement, *lines, *filter(None, [self.failures])])


class _Row(NamedTuple):
    """A row of the summary with the encoders that have a final pose."""

    name: str  # of the test with its parameters
    pose: ComparedPose
    fractions: Dict[str, FractionWithin]  # by encoder, ascending


def headline(dataset: Dataset) -> Headline:
    """Summarize with which encoders enough trials end within the tolerance, by pose source."""
    rows = _rows(dataset)
    if not rows:
        return Headline(NOTHING, {}, '')
    most = max(fraction.trials for row in rows for fraction in row.fractions.values())
    failed = sum(trial.outcome is not Outcome.SUCCEEDED for trial in dataset.trials)
    failures = f'{failed} of {len(dataset.trials)} trials did not succeed.' if failed else ''
    if most < fewest_trials():
        return Headline(_statement_of_few(most), _by_source(rows, _counts, _counts_of_all), failures)
    return Headline(_statement(), _by_source(rows, _encoders, _sufficient_cells), failures)


def _rows(dataset: Dataset) -> List[_Row]:
    rows = []
    for row in summary_rows(dataset):
        fractions = {label: fraction for label, fraction in row.fractions.items() if fraction}
        if fractions:
            rows.append(_Row(_name(row.test, row.varied), row.pose, fractions))
    return rows


def _name(test: str, varied: Varied) -> str:
    parameters = varied_texts(tuple((key.rpartition('.')[2], value) for key, value in varied))
    return f'{test} ({", ".join(parameters)})' if parameters else test


def _statement() -> str:
    return (
        f'Encoders with which at least {100 * REQUIRED_FRACTION:.0f} % of trials end {TOLERANCE_TEXT} '
        f'({100 * LEVEL:.0f} % confidence):'
    )


def _statement_of_few(most: int) -> str:
    trials = '1 trial' if most == 1 else f'{most} trials'
    return (
        f'{trials} per cell: too few trials ({fewest_trials()} needed for {100 * REQUIRED_FRACTION:.0f} %); '
        f'run advise to choose an encoder. Trials that end {TOLERANCE_TEXT}:'
    )


def _by_source(
    rows: Sequence[_Row], text_of: Callable[[_Row], str], text_of_many: Callable[[Sequence[_Row]], str]
) -> Dict[str, str]:
    """Describe each test, tests with equal texts together, or all tests as a whole where there are many."""
    texts = {}
    for pose in COMPARED_POSES:
        of_pose = [row for row in rows if row.pose is pose]
        if len(of_pose) > MOST_NAMED:
            texts[pose.text] = text_of_many(of_pose)
        elif of_pose:
            names: Dict[str, List[str]] = {}
            for row in of_pose:
                names.setdefault(text_of(row), []).append(row.name)
            texts[pose.text] = '; '.join(f'{enumeration(tests)}: {text}' for text, tests in names.items())
    return texts


def _encoders(row: _Row) -> str:
    """Name the encoders that are sufficient and those that are undecided."""
    labels, sufficient = list(row.fractions), _labels(row, Sufficiency.YES)
    undecided = _labels(row, Sufficiency.UNDECIDED)
    open_text = f' ({encoders_text(undecided)} undecided)' if undecided else ''
    if undecided == labels:
        return 'undecided'
    if not sufficient:
        return f'no encoder{open_text}'
    if sufficient == labels and len(labels) > 1:
        return 'every encoder'
    is_from_on = sufficient == labels[-len(sufficient) :] and len(sufficient) > 1
    if is_from_on and all(ppr_value(label) is not None and not is_real(label) for label in labels):
        return f'from {sufficient[0]} PPR{open_text}'
    return f'{encoders_text(sufficient)}{open_text}'


def _labels(row: _Row, sufficiency: Sufficiency) -> List[str]:
    return [label for label, fraction in row.fractions.items() if fraction.sufficiency is sufficiency]


def _sufficient_cells(rows: Sequence[_Row]) -> str:
    count = sum(len(_labels(row, Sufficiency.YES)) for row in rows)
    return f'in {count} of {sum(len(row.fractions) for row in rows)} cells'


def _counts(row: _Row) -> str:
    return _counts_of_all([row])


def _counts_of_all(rows: Sequence[_Row]) -> str:
    fractions = [fraction for row in rows for fraction in row.fractions.values()]
    return f'{sum(fraction.within for fraction in fractions)} of {sum(fraction.trials for fraction in fractions)}'
