"""Tables of an advice as text, for the terminal and the page, and the advice as JSON."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, NamedTuple

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.advice.answers import AXES, Budget, Criterion, Limit, Part
from diff_encoder_sim.advice.odometry_curve import share_within
from diff_encoder_sim.advice.odometry_study import Advice
from diff_encoder_sim.analysis.encoder_labels import ppr_text

TO_SHOWN = np.array([1e3, 1e3, np.degrees(1.0)])
UNITS = ('along [mm]', 'across [mm]', 'heading [deg]')
DECIMALS = (1, 1, 2)
REST = 'rest: observed error minus the sum of the causes; negative if causes compensate each other'
LIKE_IDEAL = (
    'like ideal: counts of an ideal encoder whose readings are as uncertain, which decides about the pose estimate\n'
    'and the true pose. within: fraction of sampled drives whose odometry is within the tolerance.\n'
    'own errors: errors of the encoder itself that are too large, and the tolerance.\n'
    '?: unknown.'
)
_MARKS = {True: 'yes', False: 'no', None: '?'}

VERSION = 1  # of the JSON
QUANTILES = (0.5, 0.8, 0.95)


class AdviceTable(NamedTuple):
    """Table of strings; the first two columns are aligned left."""

    title: str
    heads: List[str]
    rows: List[List[str]]
    note: str = ''


def advice_tables(advice: Advice) -> Iterator[AdviceTable]:
    """Yield the tables that have rows."""
    if advice.tried:
        yield _trials_table(advice)
    if advice.budgets:
        yield AdviceTable('Error budget: mean ± standard deviation', ['', 'cause', *UNITS], _budgets(advice), REST)
    if advice.stopping:
        rows = [
            [ppr_text(label), cause, f'{1e3 * spread.position_m:.1f}', f'{np.degrees(spread.yaw_rad):.2f}']
            for label, spreads in advice.stopping.items()
            for cause, spread in spreads.items()
        ]
        heads = ['encoder', 'cause', 'position [mm]', 'heading [deg]']
        yield AdviceTable('Stopping in closed form: at most', heads, rows)
    if advice.encoders:
        heads = ['encoder', 'price', 'counts', 'like ideal', 'within', *(each.head for each in advice.answers)]
        rows = [
            [
                *(encoder.name, encoder.price, f'{encoder.counts:.6g}', f'{encoder.equivalent_counts:.4g}'),
                *(encoder.share_text, *(_MARKS[encoder.meets[criterion]] for criterion in advice.answers)),
                ', '.join(f'{limit.cause} {limit.amount}' for limit in encoder.limits),
            ]
            for encoder in advice.encoders
        ]
        yield AdviceTable('Encoders on these wheels', [*heads, 'own errors'], rows, LIKE_IDEAL)


def _trials_table(advice: Advice) -> AdviceTable:
    labels = list(dict.fromkeys(tried.label for tried in sorted(advice.tried, key=lambda each: each.counts)))
    by_place = {(tried.test, tried.label): tried for tried in advice.tried}
    rows = []
    for test in dict.fromkeys(tried.test for tried in advice.tried):
        found = [by_place.get((test, label)) for label in labels]
        for criterion in advice.tried[0].within:
            counts = [each and each.within[criterion] for each in found]
            rows.append([test, criterion.text, *(f'{each.within}/{each.trials}' if each else '' for each in counts)])
    return AdviceTable('Closed-loop trials within the tolerance', ['test', '', *map(ppr_text, labels)], rows)


def _budgets(advice: Advice) -> List[List[str]]:
    """Return the rows of the budgets of odometry and of the true pose with the encoders of the answers."""
    titled: Dict[str, Budget] = {}
    for test, budgets in advice.budgets.items():
        counts = shown_counts(advice, list(budgets))
        titled[f'{test}: {Criterion.ODOMETRY.text}, {counts:g} PPR'] = budgets[counts]
    truth = advice.answers.get(Criterion.TRUTH)
    for tried in advice.tried:
        if tried.truth and truth and tried.label == truth.encoder:
            title = f'{tried.test}: {Criterion.TRUTH.text}, {ppr_text(tried.label)}, {tried.budgeted} trials'
            titled[title] = tried.truth
    return [
        ['' if index else title, cause, *_part_texts(part)]
        for title, budget in titled.items()
        for index, (cause, part) in enumerate({**budget.parts, 'rest': budget.rest, 'found': budget.found}.items())
    ]


def shown_counts(advice: Advice, counts: List[float]) -> float:
    """Return the counts whose odometry budget is shown: those of the answer, or the highest."""
    wanted = advice.answers[Criterion.ODOMETRY].budgeted_counts or max(counts)
    return min(counts, key=lambda each: abs(np.log(each / wanted)))


def _part_texts(part: Part) -> Iterator[str]:
    for bias, deviation, digits in zip(part.bias * TO_SHOWN, part.std * TO_SHOWN, DECIMALS):
        # Adding zero removes the sign of a rounded zero.
        yield f'{round(bias, digits) + 0.0:+.{digits}f} ± {round(deviation, digits) + 0.0:.{digits}f}'


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
    texts = []
    for table in advice_tables(advice):
        aligned = ['left', 'left', *['right'] * (len(table.heads) - 2)]
        text = tabulate(table.rows, table.heads, disable_numparse=True, colalign=aligned)
        texts.append('\n'.join(filter(None, [table.title, text, table.note])))
    return '\n\n'.join(texts)


def advice_json(advice: Advice) -> Dict[str, Any]:
    """Return the advice as JSON data; lengths in metres, angles in radians."""
    requirement = advice.requirement
    return {
        'version': VERSION,
        'robot': {'name': advice.robot, 'own_ppr': advice.own_counts},
        'requirement': requirement._asdict(),
        'answers': {
            criterion.value: {
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
            for criterion, answer in advice.answers.items()
        },
        'closed_form_ppr': advice.closed_form,
        'curves': {
            curve.test: [
                {
                    'ppr': counts,
                    'share': float(np.mean(requirement.within(errors))),
                    'interval': list(share_within(errors, requirement)),
                    'std': errors.std(axis=0).tolist(),
                    'quantiles': {f'{q:g}': np.quantile(np.abs(errors), q, axis=0).tolist() for q in QUANTILES},
                }
                for counts, errors in sorted(curve.errors.items())
            ]
            for curve in advice.curves.curves
        },
        'budgets': {
            test: [{'ppr': counts, **_budget(budget)} for counts, budget in budgets.items()]
            for test, budgets in advice.budgets.items()
        },
        'stopping': {
            label: {cause: spread._asdict() for cause, spread in spreads.items()}
            for label, spreads in advice.stopping.items()
        },
        'trials': [
            {
                'test': tried.test,
                'encoder': tried.label,
                'ppr': tried.counts,
                'within': {criterion.value: counts._asdict() for criterion, counts in tried.within.items()},
                'budget': tried.truth and _budget(tried.truth),
                'budgeted': tried.budgeted,
            }
            for tried in advice.tried
        ],
        'encoders': [
            {
                'name': encoder.name,
                'price': encoder.price or None,
                'ppr': encoder.counts,
                'equivalent_ppr': encoder.equivalent_counts,
                'odometry_share': list(encoder.share),
                'meets': {criterion.value: meets for criterion, meets in encoder.meets.items()},
                'limit': [_limit(limit) for limit in encoder.limits],
            }
            for encoder in advice.encoders
        ],
    }


def _limit(limit: Limit) -> Dict[str, Any]:
    return {**limit._asdict(), 'axis': AXES[limit.axis]}


def _budget(budget: Budget) -> Dict[str, Any]:
    parts = {cause: _part(part) for cause, part in budget.parts.items()}
    return {'parts': parts, 'rest': _part(budget.rest), 'found': _part(budget.found)}


def _part(part: Part) -> Dict[str, Dict[str, float]]:
    columns = zip(AXES, part.bias.tolist(), part.variance.tolist())
    return {axis: {'bias': bias, 'variance': variance} for axis, bias, variance in columns}
