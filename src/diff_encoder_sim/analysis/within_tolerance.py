"""With which encoders enough trials end within the tolerance: counts by cell, and the headline of an analysis.

At least four trials in five must end within it with 95 % confidence: Wilson's interval of the fraction must lie on one
side of 80 %.
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Callable, Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.encoder_labels import encoders_text, enumeration, is_real, ppr_value
from diff_encoder_sim.analysis.quantities import LEVEL, MINUS_TRUTH, QUANTITIES, REQUIRED_FRACTION, YAW, X, Y
from diff_encoder_sim.analysis.results_table import Results, are_within, varied_texts
from diff_encoder_sim.analysis.statistics import Interval, wilson
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_cells import VARIANT

if TYPE_CHECKING:
    import pandas as pd
else:
    pd = deferred('pandas')

TOLERANCE_TEXT = f'within {X.tolerance:g} m in x and y and {YAW.tolerance:g} degrees'

# Final poses that are compared with the goal, or with the true pose. At the goal, a part of the odometry's error is
# that the robot stops elsewhere.
COMPARED_POSES = {
    'world': 'true pose at the goal',
    'global': 'pose estimate at the goal',
    'odom': 'odometry at the goal',
    MINUS_TRUTH: 'odometry at the true pose',
}

# More tests, counted with their sets of parameters, are not named but only counted.
MOST_NAMED = 3

NO_POSE = 'No trial ended with a pose: nothing can be concluded.'


class Sufficiency(enum.Enum):
    """Whether the required fraction of trials ends within the tolerance."""

    YES = 'yes'
    NO = 'no'
    UNDECIDED = 'undecided'  # too few trials


class FractionWithin(NamedTuple):
    """The number of trials of a cell that end within the tolerance, by one final pose."""

    trials: int  # that ended with the pose
    within: int  # in position and heading
    within_position: int  # in x and in y
    within_heading: int
    interval: Interval  # of the fraction within / trials

    @property
    def sufficiency(self) -> Sufficiency:
        """Compare the interval with the required fraction."""
        if self.interval.low >= REQUIRED_FRACTION:
            return Sufficiency.YES
        return Sufficiency.NO if self.interval.high < REQUIRED_FRACTION else Sufficiency.UNDECIDED


def fraction_within(trials: pd.DataFrame, pose: str) -> Optional[FractionWithin]:
    """Count the trials within the tolerance, whatever their outcome; None if none has the pose (of `POSES`)."""
    count = int(trials[f'{pose}_x_m'].notna().sum())
    if count == 0:
        return None
    both, position, heading = (int(are_within(trials, pose, part).sum()) for part in (QUANTITIES, (X, Y), (YAW,)))
    return FractionWithin(count, both, position, heading, wilson(both, count))


def fewest_trials() -> int:
    """Return the number of trials that show the required fraction when all of them end within the tolerance."""
    count = 1
    while wilson(count, count).low < REQUIRED_FRACTION:
        count += 1
    return count


class SummaryRow(NamedTuple):
    """One test with one set of parameters, by one final pose."""

    setup: str
    name: str  # of the setup in the headline
    variant: Optional[str]  # None without variants
    pose: str  # of COMPARED_POSES
    fractions: Dict[str, Optional[FractionWithin]]  # by encoder, ascending; None without a final pose


def summary_rows(results: Results) -> List[SummaryRow]:
    """Count the trials within tolerance: by test and set of parameters, a row for each of `COMPARED_POSES`."""
    short = [key.rpartition('.')[2] for key in results.varied]
    rows = []
    for setup, of_setup in results.trials.groupby('setup', sort=False):
        first, cells = of_setup.iloc[0], dict(list(of_setup.groupby('ppr', sort=False)))
        parameters = ', '.join(varied_texts(list(first[results.varied]), short))
        name = f'{first["test"]} ({parameters})' if parameters else first['test']
        for pose in COMPARED_POSES:
            fractions = {label: fraction_within(trials, pose) for label, trials in cells.items()}
            rows.append(SummaryRow(setup, name, first.get(VARIANT), pose, fractions))
    return rows


class Headline(NamedTuple):
    """What the trials show about the encoders."""

    statement: str  # what is listed by pose
    by_source: Dict[str, str]  # by text of the final pose
    failures: str  # empty if all trials succeeded

    @property
    def text(self) -> str:
        """Return the headline as lines for the terminal."""
        width = max(map(len, self.by_source), default=0)
        lines = [f'  {source + ":":{width + 1}} {text}' for source, text in self.by_source.items()]
        return '\n'.join([self.statement, *lines, *filter(None, [self.failures])])


class _Row(NamedTuple):
    """A row of the summary with the encoders that have a final pose."""

    name: str
    pose: str
    fractions: Dict[str, FractionWithin]  # by encoder, ascending


def headline(rows: Sequence[SummaryRow], trials: pd.DataFrame) -> Headline:
    """Summarize with which encoders enough trials end within the tolerance, by final pose, from `summary_rows`."""
    known = [_Row(row.name, row.pose, {label: one for label, one in row.fractions.items() if one}) for row in rows]
    known = [row for row in known if row.fractions]
    if not known:
        return Headline(NO_POSE, {}, '')
    most = max(fraction.trials for row in known for fraction in row.fractions.values())
    failed = int((trials['outcome'] != Outcome.SUCCEEDED.value).sum())
    failures = f'{failed} of {len(trials)} trials did not succeed.' if failed else ''
    percent = 100 * REQUIRED_FRACTION
    if most < fewest_trials():
        count = '1 trial' if most == 1 else f'{most} trials'
        statement = (
            f'{count} per cell: too few trials ({fewest_trials()} needed for {percent:.0f} %); '
            f'run advise to choose an encoder. Trials that end {TOLERANCE_TEXT}:'
        )
        return Headline(statement, _by_pose(known, lambda row: _counts([row]), _counts), failures)
    statement = (
        f'Encoders with which at least {percent:.0f} % of trials end {TOLERANCE_TEXT} ({100 * LEVEL:.0f} % confidence):'
    )
    return Headline(statement, _by_pose(known, _encoders, _sufficient_cells), failures)


def _by_pose(
    rows: Sequence[_Row], text_of: Callable[[_Row], str], text_of_many: Callable[[Sequence[_Row]], str]
) -> Dict[str, str]:
    """Describe each test, tests with equal texts together, or all tests as a whole if there are many."""
    texts = {}
    for pose, text in COMPARED_POSES.items():
        of_pose = [row for row in rows if row.pose == pose]
        if len(of_pose) > MOST_NAMED:
            texts[text] = text_of_many(of_pose)
        elif of_pose:
            names: Dict[str, List[str]] = {}
            for row in of_pose:
                names.setdefault(text_of(row), []).append(row.name)
            texts[text] = '; '.join(f'{enumeration(tests)}: {about}' for about, tests in names.items())
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
    are_finest = sufficient == labels[-len(sufficient) :] and len(sufficient) > 1
    if are_finest and all(ppr_value(label) is not None and not is_real(label) for label in labels):
        return f'from {sufficient[0]} PPR{open_text}'
    return f'{encoders_text(sufficient)}{open_text}'


def _labels(row: _Row, sufficiency: Sufficiency) -> List[str]:
    return [label for label, fraction in row.fractions.items() if fraction.sufficiency is sufficiency]


def _sufficient_cells(rows: Sequence[_Row]) -> str:
    count = sum(len(_labels(row, Sufficiency.YES)) for row in rows)
    return f'in {count} of {sum(len(row.fractions) for row in rows)} cells'


def _counts(rows: Sequence[_Row]) -> str:
    fractions = [fraction for row in rows for fraction in row.fractions.values()]
    return f'{sum(fraction.within for fraction in fractions)} of {sum(fraction.trials for fraction in fractions)}'
