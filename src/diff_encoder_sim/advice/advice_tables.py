"""Tables of an advice as text, for the terminal and the page."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, NamedTuple, Sequence

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.advice.advice import Advice, TriedEncoder
from diff_encoder_sim.advice.answers import AXES, Answer, Budget, Criterion, Limit, Part, Requirement
from diff_encoder_sim.advice.listed_encoders import ListedEncoder
from diff_encoder_sim.advice.odometry_curve import Curve, share_within
from diff_encoder_sim.analysis.encoder_labels import ppr_text

TO_SHOWN = np.array([1e3, 1e3, np.degrees(1.0)])
UNITS = ('along [mm]', 'across [mm]', 'heading [deg]')
DECIMALS = (1, 1, 2)

_MARKS = {True: 'yes', False: 'no', None: '?'}


class AdviceTable(NamedTuple):
    """Table of strings."""

    title: str
    heads: List[str]
    rows: List[List[str]]
    keys: int  # number of left-aligned columns
    note: str = ''


def advice_tables(advice: Advice) -> Iterator[AdviceTable]:
    """Yield the tables that have rows."""
    if advice.tried:
        yield _trials_table(advice)
    if advice.budgets:
        yield _budget_table(advice)
    if advice.stopping:
        yield _stopping_table(advice)
    if advice.encoders:
        yield _encoder_table(advice)


def _trials_table(advice: Advice) -> AdviceTable:
    labels = list(dict.fromkeys(tried.label for tried in sorted(advice.tried, key=lambda each: each.counts)))
    by_place = {(tried.test, tried.label): tried for tried in advice.tried}
    rows = []
    for test in dict.fromkeys(tried.test for tried in advice.tried):
        for criterion in next(iter(by_place.values())).within:
            found = [by_place.get((test, label)) for label in labels]
            texts = [
                f'{each.within[criterion].within}/{each.within[criterion].trials}' if each else '' for each in found
            ]
            rows.append([test, criterion.text, *texts])
    return AdviceTable('Closed-loop trials within the tolerance', ['test', '', *map(ppr_text, labels)], rows, 2)


def _budget_table(advice: Advice) -> AdviceTable:
    rows: List[List[str]] = []
    for test, budgets in advice.budgets.items():
        counts = shown_counts(advice, list(budgets))
        rows += _budget_rows(f'{test}: {Criterion.ODOMETRY.text}, {counts:g} PPR', budgets[counts])
    truth = advice.answers.get(Criterion.TRUTH)
    for tried in advice.tried:
        if tried.truth and truth and tried.label == truth.encoder:
            what = f'{tried.test}: {Criterion.TRUTH.text}, {ppr_text(tried.label)}, {tried.budgeted} trials'
            rows += _budget_rows(what, tried.truth)
    return AdviceTable('Error budget: mean ± standard deviation', ['', 'cause', *UNITS], rows, 2, REST)


REST = 'rest: observed error minus the sum of the causes; negative if causes compensate each other'


def shown_counts(advice: Advice, counts: List[float]) -> float:
    """Return the counts whose odometry budget is shown: those of the answer, or the highest."""
    wanted = advice.answers[Criterion.ODOMETRY].budgeted_counts or max(counts)
    return min(counts, key=lambda each: abs(np.log(each / wanted)))


def _budget_rows(title: str, budget: Budget) -> List[List[str]]:
    named = {**budget.parts, 'rest': budget.rest, 'found': budget.found}
    rows = [['', cause, *_part_texts(part)] for cause, part in named.items()]
    rows[0][0] = title
    return rows


def _part_texts(part: Part) -> List[str]:
    shown = zip(part.bias * TO_SHOWN, part.std * TO_SHOWN, DECIMALS)
    # Adding zero removes the sign of a rounded zero.
    return [
        f'{round(bias, digits) + 0.0:+.{digits}f} ± {round(std, digits) + 0.0:.{digits}f}'
        for bias, std, digits in shown
    ]


def _stopping_table(advice: Advice) -> AdviceTable:
    rows = [
        [ppr_text(label), cause, f'{1e3 * spread.position_m:.1f}', f'{np.degrees(spread.yaw_rad):.2f}']
        for label, spreads in advice.stopping.items()
        for cause, spread in spreads.items()
    ]
    heads = ['encoder', 'cause', 'position [mm]', 'heading [deg]']
    return AdviceTable('Stopping in closed form: at most', heads, rows, 2)


def _encoder_table(advice: Advice) -> AdviceTable:
    criteria = (criterion.head for criterion in advice.answers)
    heads = ['encoder', 'price', 'counts', 'like ideal', 'within', *criteria, 'own errors']
    rows = [_encoder_row(encoder, list(advice.answers)) for encoder in advice.encoders]
    return AdviceTable('Encoders on these wheels', heads, rows, 2, LIKE_IDEAL)


LIKE_IDEAL = (
    'like ideal: counts of an ideal encoder whose readings are as uncertain, which decides about the pose estimate\n'
    'and the true pose. within: fraction of sampled drives whose odometry is within the tolerance.\n'
    'own errors: errors of the encoder itself that are too large, and the tolerance.\n'
    '?: unknown.'
)


def _encoder_row(encoder: ListedEncoder, criteria: Sequence[Criterion]) -> List[str]:
    return [
        encoder.name,
        encoder.price,
        f'{encoder.counts:.6g}',
        f'{encoder.equivalent_counts:.4g}',
        encoder.share_text,
        *(_MARKS[encoder.meets[criterion]] for criterion in criteria),
        ', '.join(f'{limit.cause} {limit.amount}' for limit in encoder.limits),
    ]


def answers_text(advice: Advice) -> str:
    """Return one line per criterion."""
    return '\n'.join(f'  {criterion.text}: {answer}' for criterion, answer in advice.answers.items())


def closed_form_text(advice: Advice) -> str:
    """Return the counts that quantisation requires, by test."""
    return ', '.join(f'{test} {counts:.0f}' for test, counts in advice.closed_form.items())


def own_encoder_text(advice: Advice) -> str:
    """Return the resolution of the robot's own encoder; '' if unknown."""
    return f"The robot's own encoder has {advice.own_counts:g} PPR." if advice.own_counts else ''


def tables_text(advice: Advice) -> str:
    """Return all tables as text."""
    return '\n\n'.join(map(_table_text, advice_tables(advice)))


def _table_text(table: AdviceTable) -> str:
    aligned = ['left'] * table.keys + ['right'] * (len(table.heads) - table.keys)
    text = tabulate(table.rows, table.heads, disable_numparse=True, colalign=aligned)
    return '\n'.join([table.title, text, *([table.note] if table.note else [])])


VERSION = 1
QUANTILES = (0.5, 0.8, 0.95)


def advice_json(advice: Advice) -> Dict[str, Any]:
    """Return the advice as JSON data; lengths in metres, angles in radians."""
    requirement = advice.requirement
    return {
        'version': VERSION,
        'robot': {'name': advice.robot, 'own_ppr': advice.own_counts},
        'requirement': requirement._asdict(),
        'answers': {criterion.value: _answer(answer) for criterion, answer in advice.answers.items()},
        'closed_form_ppr': advice.closed_form,
        'curves': {curve.test: _curve(curve, requirement) for curve in advice.curves.curves},
        'budgets': {
            test: [{'ppr': counts, **_budget(budget)} for counts, budget in budgets.items()]
            for test, budgets in advice.budgets.items()
        },
        'stopping': {
            label: {cause: spread._asdict() for cause, spread in spreads.items()}
            for label, spreads in advice.stopping.items()
        },
        'trials': [_tried(tried) for tried in advice.tried],
        'encoders': [_encoder(encoder) for encoder in advice.encoders],
    }


def _answer(answer: Answer) -> Dict[str, Any]:
    return {
        'kind': answer.kind.value,
        'smallest_ppr': answer.counts,
        'interval': list(answer.interval),
        'encoder': answer.encoder or None,
        'limit': [_limit(limit) for limit in answer.limits],
        'more_trials': answer.more_trials,
        'undecided_encoder': answer.undecided or None,
        'errors_of': answer.errors_of or None,
        'text': str(answer),
    }


def _limit(limit: Limit) -> Dict[str, Any]:
    return {**limit._asdict(), 'axis': AXES[limit.axis]}


def _curve(curve: Curve, requirement: Requirement) -> List[Dict[str, Any]]:
    return [
        {
            'ppr': counts,
            'share': float(np.mean(requirement.within(errors))),
            'interval': list(share_within(errors, requirement)),
            'std': errors.std(axis=0).tolist(),
            'quantiles': {f'{level:g}': np.quantile(np.abs(errors), level, axis=0).tolist() for level in QUANTILES},
        }
        for counts, errors in sorted(curve.errors.items())
    ]


def _budget(budget: Budget) -> Dict[str, Any]:
    parts = {cause: _part(part) for cause, part in budget.parts.items()}
    return {'parts': parts, 'rest': _part(budget.rest), 'found': _part(budget.found)}


def _part(part: Part) -> Dict[str, Dict[str, float]]:
    return {
        axis: {'bias': float(bias), 'variance': float(variance)}
        for axis, bias, variance in zip(AXES, part.bias, part.variance)
    }


def _tried(tried: TriedEncoder) -> Dict[str, Any]:
    return {
        'test': tried.test,
        'encoder': tried.label,
        'ppr': tried.counts,
        'within': {criterion.value: counts._asdict() for criterion, counts in tried.within.items()},
        'budget': tried.truth and _budget(tried.truth),
        'budgeted': tried.budgeted,
    }


def _encoder(encoder: ListedEncoder) -> Dict[str, Any]:
    return {
        'name': encoder.name,
        'price': encoder.price or None,
        'ppr': encoder.counts,
        'equivalent_ppr': encoder.equivalent_counts,
        'odometry_share': list(encoder.share),
        'meets': {criterion.value: meets for criterion, meets in encoder.meets.items()},
        'limit': [_limit(limit) for limit in encoder.limits],
    }
