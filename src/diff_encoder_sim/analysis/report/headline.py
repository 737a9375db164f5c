"""The answer in one sentence, for the top of the report and the end of analyze's output."""

from __future__ import annotations

from typing import Callable, Dict, List, Sequence

from diff_encoder_sim.analysis.dataset import Dataset, ppr_value
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.analysis.report.summary import Line, answer, encoder_names, listed
from diff_encoder_sim.analysis.table_keys import varied_texts
from diff_encoder_sim.analysis.within_tolerance import REQUIRED_FRACTION, WORDS_OF_SOURCE, Reach, Share, fewest_trials
from diff_encoder_sim.evaluation.sample_statistics import LEVEL
from diff_encoder_sim.trials.trial_outcome import Outcome

# A sentence names so many tests, as the paper has, and no more; sets of parameters count.
MOST_NAMED = 3

GOAL = f'within {X.tolerance:g} m and {YAW.tolerance:g} degrees of the goal'


def main_line(dataset: Dataset) -> str:
    """One or two sentences."""
    lines = [
        line._replace(shares={label: share for label, share in line.shares.items() if share})
        for line in answer(dataset)
    ]
    lines = [line for line in lines if line.shares]
    if not lines:
        return 'No trial ended with a pose: nothing can be said.'
    most = max(share.trials for line in lines for share in line.shares.values())
    sentence = _of_few(lines, most) if most < fewest_trials() else _of_enough(lines)
    return f'{sentence}.{_failures(dataset)}'


def _of_enough(lines: Sequence[Line]) -> str:
    return (
        f'At least {100 * REQUIRED_FRACTION:.0f} % of trials end {GOAL} ({100 * LEVEL:.0f} % '
        f'confidence): {_by_source(lines, _encoders, _count_reached)}'
    )


def _of_few(lines: Sequence[Line], most: int) -> str:
    """A share cannot be shown: what was counted, over all encoders."""
    trials = '1 trial' if most == 1 else f'{most} trials'
    return (
        f'With {trials} a cell no share of {100 * REQUIRED_FRACTION:.0f} % can be shown, which '
        f'takes {fewest_trials()}. So far end {GOAL}: '
        f'{_by_source(lines, _counts, lambda of_source: _counts_of(_shares(of_source)))}'
    )


def _by_source(
    lines: Sequence[Line], told: Callable[[Line], str], told_of_many: Callable[[Sequence[Line]], str]
) -> str:
    """What is told of each test, or of all where there are many; tests of the same go together."""
    parts = []
    for source, words in WORDS_OF_SOURCE.items():
        of_source = [line for line in lines if line.source == source]
        if len(of_source) > MOST_NAMED:
            parts.append(f'{words} {told_of_many(of_source)}')
        elif of_source:
            tests: Dict[str, List[str]] = {}
            for line in of_source:
                tests.setdefault(told(line), []).append(_name(line))
            parts.append(f'{words} ' + ', '.join(f'{listed(names)} {text}' for text, names in tests.items()))
    return '; '.join(parts)


def _encoders(line: Line) -> str:
    """With which encoders the tolerance is reached, and for which that is open."""
    labels, reached = list(line.shares), _labels(line, Reach.YES)
    undecided = _labels(line, Reach.UNDECIDED)
    if undecided == labels:
        return 'undecided'
    if not reached:
        return f'with none{_open(undecided)}'
    if reached == labels and len(labels) > 1:
        return 'with every encoder'
    is_from_on = reached == labels[-len(reached) :] and len(reached) > 1
    if is_from_on and all(ppr_value(label) is not None for label in labels):
        return f'from {reached[0]} PPR on{_open(undecided)}'
    return f'with {encoder_names(reached)}{_open(undecided)}'


def _labels(line: Line, reach: Reach) -> List[str]:
    return [label for label, share in line.shares.items() if share.reach is reach]


def _open(undecided: Sequence[str]) -> str:
    return f' ({encoder_names(undecided)} undecided)' if undecided else ''


def _count_reached(lines: Sequence[Line]) -> str:
    shares = _shares(lines)
    reached = sum(share.reach is Reach.YES for share in shares)
    return f'in {reached} of {len(shares)} cells'


def _counts(line: Line) -> str:
    return _counts_of(list(line.shares.values()))


def _counts_of(shares: Sequence[Share]) -> str:
    return f'{sum(share.within for share in shares)} of {sum(share.trials for share in shares)}'


def _shares(lines: Sequence[Line]) -> List[Share]:
    return [share for line in lines for share in line.shares.values()]


def _failures(dataset: Dataset) -> str:
    failed = sum(trial.outcome is not Outcome.SUCCEEDED for trial in dataset.trials)
    return f' {failed} of {len(dataset.trials)} trials did not succeed.' if failed else ''


def _name(line: Line) -> str:
    varied = varied_texts(tuple((key.rpartition('.')[2], value) for key, value in line.varied))
    return f'{line.test} ({", ".join(varied)})' if varied else line.test
