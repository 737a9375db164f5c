"""Tables of an advice as text, for the terminal and the page, and the advice as JSON."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List

import numpy as np

from diff_encoder_sim.advice import drive_draws
from diff_encoder_sim.advice.answers import AXES, Budget, Criterion
from diff_encoder_sim.advice.odometry_answer import share_within
from diff_encoder_sim.advice.odometry_study import Advice
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.text_tables import TextTable

TO_SHOWN = np.array([1e3, 1e3, np.degrees(1.0)])
UNITS = ('along [mm]', 'across [mm]', 'heading [deg]')
DECIMALS = (1, 1, 2)
BUDGET_HEADS = ['', 'cause', *UNITS, 'position [%]']
REST = (
    'position: fraction of the variance of x and y.\n'
    'rest: observed error minus the sum of the causes; without ± if causes compensate each other'
)
LIKE_IDEAL = (
    'like ideal: counts of an ideal encoder whose readings are as uncertain, which decides about the pose estimate\n'
    'and the true pose. within: fraction of sampled drives whose odometry is within the tolerance.\n'
    'own errors: errors of the encoder itself that are too large, and the tolerance.\n'
    '?: unknown.'
)
_MARKS = {True: 'yes', False: 'no', None: '?'}

VERSION = 1  # of the JSON
QUANTILES = (0.5, 0.8, 0.95)
BOUND = 1.96  # standard deviations of a 95 % interval to each side


def advice_tables(advice: Advice) -> Iterator[TextTable]:
    """Yield the tables that have rows."""
    if advice.tried:
        yield _trials_table(advice)
    if advice.budgets:
        yield TextTable('Error budget: mean ± standard deviation', BUDGET_HEADS, _budgets(advice), REST)
    if advice.stopping:
        rows = [
            [ppr_text(label), cause, f'{1e3 * spread.position_m:.1f}', f'{np.degrees(spread.yaw_rad):.2f}']
            for label, spreads in advice.stopping.items()
            for cause, spread in spreads.items()
        ]
        heads = ['encoder', 'cause', 'position [mm]', 'heading [deg]']
        yield TextTable('Stopping in closed form: at most', heads, rows)
    if advice.encoders:
        heads = ['encoder', 'price', 'counts', 'like ideal', 'within', *(each.head for each in advice.answers)]
        rows = [
            [
                *(encoder.name, encoder.price or '', f'{encoder.ppr:.6g}', f'{encoder.equivalent_ppr:.4g}'),
                *(encoder.share_text, *(_MARKS[encoder.meets[criterion]] for criterion in advice.answers)),
                ', '.join(f'{limit.cause} {limit.amount}' for limit in encoder.limit),
            ]
            for encoder in advice.encoders
        ]
        yield TextTable('Encoders on these wheels', [*heads, 'own errors'], rows, LIKE_IDEAL)


def _trials_table(advice: Advice) -> TextTable:
    tried = sorted(advice.tried, key=lambda each: each.ppr)
    rows = [
        [test, criterion.text, *('{}/{}'.format(*each.within[criterion]) for each in tried if each.test == test)]
        for test in dict.fromkeys(each.test for each in advice.tried)
        for criterion in Criterion
    ]
    heads = ['test', '', *(ppr_text(encoder) for encoder in dict.fromkeys(each.encoder for each in tried))]
    return TextTable('Closed-loop trials within the tolerance', heads, rows)


def _budgets(advice: Advice) -> List[List[str]]:
    """Return the rows of the budgets of odometry and of the true pose with the encoders of the answers."""
    titled: Dict[str, Budget] = {}
    for test, budgets in advice.budgets.items():
        counts = shown_counts(advice, list(budgets))
        titled[f'{test}: {Criterion.ODOMETRY.text}, {counts:g} PPR'] = budgets[counts]
    truth = advice.answers.get(Criterion.TRUTH)
    for tried in advice.tried:
        if tried.budget and truth and tried.encoder == truth.encoder:
            title = f'{tried.test}: {Criterion.TRUTH.text}, {ppr_text(tried.encoder)}, {tried.budgeted} trials'
            titled[title] = tried.budget
    rows = []
    for title, budget in titled.items():
        for index, (cause, part) in enumerate(budget.every.items()):
            numbers = zip(part.bias * TO_SHOWN, part.std * TO_SHOWN, DECIMALS)
            # Adding zero removes the sign of a rounded zero.
            texts = (
                f'{round(mean, n) + 0.0:+.{n}f}' + (f' ± {abs(std):.{n}f}' if round(std, n) >= 0.0 else '')
                for mean, std, n in numbers
            )
            fraction = round(100.0 * budget.position_fractions[cause], 1) + 0.0
            rows.append(['' if index else title, cause, *texts, f'{fraction:.1f}'])
    return rows


def shown_counts(advice: Advice, counts: List[float]) -> float:
    """Return the counts whose odometry budget is shown: those of the answer, or the highest."""
    wanted = advice.answers[Criterion.ODOMETRY].budgeted_counts or max(counts)
    return min(counts, key=lambda each: abs(np.log(each / wanted)))


def answers_text(advice: Advice) -> str:
    """Return one line per criterion, and the assumptions."""
    lines = [f'  {criterion.text}: {answer}' for criterion, answer in advice.answers.items()]
    return '\n'.join([*lines, f'  assumes {assumptions_text(advice)}'])


def assumptions_text(advice: Advice) -> str:
    """Return the assumptions about wheels, slip, floor and route in one line."""
    tests = [curve.draws for curve in advice.curves.curves]
    robot, drives = tests[0].robot, ' and '.join(draws.drive.test for draws in tests)
    if robot.calibration is not None:
        stds, count = np.sqrt(np.diag(robot.calibrated_covariance)), len(robot.calibration.drives)
        keys = 'left_wheel_diameter_m', 'radius_ratio', 'radius_per_separation'
        scale, ratio, turning = (
            'nominal' if key in robot.calibration.undetermined else f'to {100.0 * BOUND * std:.2g} %'
            for key, std in zip(keys, stds)
        )
        wheels = f'wheels and slip as calibrated on {count} drive{"s" if count > 1 else ""}: '
        wheels += f'ratio of radii {ratio}, radius / separation {turning}, scale {scale}'
    else:
        has_errors = robot.has(drive_draws.RADIUS) or robot.has(drive_draws.SEPARATION)
        wheels = 'the wheel errors of the robot file' if has_errors else 'exact wheels'
        wheels += '; the slip of the robot file' if robot.has(drive_draws.SLIP) else '; no slip'
    if tests[0].drive.is_recorded:
        return f'{wheels}; the path of {drives}, repeated'
    return f"{wheels}; {drives} on the simulator's level floor, with its grip"


def closed_form_text(advice: Advice) -> str:
    """Return the counts that quantisation requires, by test."""
    return ', '.join(f'{test} {counts:.0f}' for test, counts in advice.closed_form.items())


def own_encoder_text(advice: Advice) -> str:
    """Return the resolution of the robot's own encoder; '' if unknown."""
    return f"The robot's own encoder has {advice.own_counts:g} PPR." if advice.own_counts else ''


def advice_json(advice: Advice) -> Dict[str, Any]:
    """Return the advice as JSON data; lengths in metres, angles in radians."""
    requirement = advice.requirement
    return {
        'version': VERSION,
        'robot': {'name': advice.robot, 'own_ppr': advice.own_counts},
        'requirement': requirement._asdict(),
        'answers': {
            criterion: {
                'kind': answer.kind,
                'smallest_ppr': answer.counts,
                'interval': answer.interval,
                'encoder': answer.encoder or None,
                'limit': [limit._asdict() for limit in answer.limits],
                'more_trials': answer.more_trials,
                'undecided_encoder': answer.undecided or None,
                'errors_of': answer.errors_of or None,
                'text': str(answer),
            }
            for criterion, answer in advice.answers.items()
        },
        'assumptions': assumptions_text(advice),
        'closed_form_ppr': advice.closed_form,
        'curves': {
            curve.test: [
                {
                    'ppr': counts,
                    'share': float(np.mean(requirement.within(errors))),
                    'interval': share_within(errors, requirement),
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
                **tried._asdict(),
                'within': {criterion: counts._asdict() for criterion, counts in tried.within.items()},
                'budget': tried.budget and _budget(tried.budget),
            }
            for tried in advice.tried
        ],
        'encoders': [
            {**encoder._asdict(), 'limit': [limit._asdict() for limit in encoder.limit]} for encoder in advice.encoders
        ],
    }


def _budget(budget: Budget) -> Dict[str, Any]:
    every = {
        cause: {
            axis: {'bias': bias, 'variance': variance}
            for axis, bias, variance in zip(AXES, part.bias.tolist(), part.variance.tolist())
        }
        for cause, part in budget.every.items()
    }
    parts = {cause: every[cause] for cause in budget.parts}
    fractions = {cause: budget.position_fractions[cause] for cause in budget.parts}
    return {'parts': parts, 'rest': every['rest'], 'found': every['found'], 'position_fractions': fractions}
