"""Tables of an advice as text, for the terminal and the page, and the advice as JSON."""

from __future__ import annotations

import math
import os
import re
import textwrap
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice import drive_draws
from diff_encoder_sim.advice.answers import AXES, Budget, Criterion, Kind, Limit, Requirement, amount_text
from diff_encoder_sim.advice.fused_draws import STANDSTILL_S
from diff_encoder_sim.advice.imu_answer import ImuAnswer, imu_rows, imu_tables
from diff_encoder_sim.advice.odometry_answer import share_within
from diff_encoder_sim.advice.odometry_study import Advice, ListedEncoder
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.result_tables import TextTable
from diff_encoder_sim.base.rounding import rounded
from diff_encoder_sim.robots.wheel_quality import BEST_STD, EXACT, ROBOT_FILE, WheelQuality
from diff_encoder_sim.wheels.catalogue import EncoderFileParams

PIPE_COLUMNS = 100  # of answers that do not go to a terminal, or to one that does not state its width

TO_SHOWN = np.array([1e3, 1e3, np.degrees(1.0)])
UNITS = ('along [mm]', 'across [mm]', 'heading [deg]')
DECIMALS = (1, 1, 2)
BUDGET_HEADS = ['cause', *UNITS, 'position [%]']
REST = (
    'position: fraction of the variance of x and y.\n'
    'rest: observed error minus the sum of the causes; without ± if causes compensate each other'
)
LIKE_IDEAL = (
    'like ideal: counts of an ideal encoder whose readings are as uncertain, which decides about the pose estimate '
    'and the true pose.\n'
    'within: fraction of sampled drives whose odometry is within the tolerance.\n'
    'shaft: that it is mounted on. ?: unknown.'
)
TOO_LARGE = 'own errors of {} that are too large: {}'
Products = Mapping[str, Callable[[EncoderFileParams], str]]  # text by head of a column
# For the terminal; more columns do not fit PIPE_COLUMNS.
PRODUCTS: Products = {'price': lambda file: file.price, 'shaft': lambda file: file.shaft}
_MARKS = {True: 'yes', False: 'no', None: '?'}

VERSION = 1  # of the JSON
OF_PRODUCT = ('manufacturer', 'part', 'type', 'price', 'shaft', 'link')  # keys of an encoder with a file
OF_IMU = ('imu', 'kind', 'smallest_ppr', 'interval', 'text')  # keys of an answer
QUANTILES = (0.5, 0.8, 0.95)
BOUND = 1.96  # standard deviations of a 95 % interval to each side


def advice_tables(advice: Advice, products: Products = PRODUCTS) -> Iterator[TextTable]:
    """Yield the tables that have rows; `products` are columns about encoders."""
    if advice.tried:
        yield _trials_table(advice)
    budgets = _shown_budgets(advice)
    for title, budget in budgets.items():
        note = REST if title == [*budgets][-1] else ''
        yield TextTable(f'Error budget, mean ± standard deviation: {title}', BUDGET_HEADS, _rows(budget), note, 1)
    yield from imu_tables(advice.imus)
    if advice.stopping:
        rows = [
            [ppr_text(label), cause, f'{1e3 * spread.position_m:.1f}', f'{np.degrees(spread.yaw_rad):.2f}']
            for label, spreads in advice.stopping.items()
            for cause, spread in spreads.items()
        ]
        heads = ['encoder', 'cause', 'position [mm]', 'heading [deg]']
        yield TextTable('Stopping in closed form: at most', heads, rows)
    for is_of_robot, title in enumerate(('Encoders on these wheels', 'Encoders of robots on these wheels')):
        listed = [encoder for encoder in advice.encoders if encoder.is_of_robot == is_of_robot]
        columns = {head: text for head, text in products.items() if head != 'price' or not is_of_robot}
        heads = ['encoder', *columns, 'counts', 'like\nideal', 'within']
        rows = [
            [
                *(encoder.name, *(text(encoder.real) if encoder.real else '' for text in columns.values())),
                *(f'{encoder.ppr:.6g}', f'{encoder.equivalent_ppr:.4g}', encoder.share_text),
                *(_MARKS[encoder.meets[criterion]] for criterion in advice.answers),
            ]
            for encoder in listed
        ]
        limits = {each.name: '; '.join(f'{one.cause} {one.amount}' for one in each.limit) for each in listed}
        notes = [TOO_LARGE.format(name, text) for name, text in limits.items() if text]
        notes[:0] = [] if is_of_robot else [LIKE_IDEAL]
        heads += [criterion.head.replace(' ', '\n') for criterion in advice.answers]
        if rows:
            yield TextTable(title, heads, rows, '\n'.join(notes), 1 + len(columns))


def _trials_table(advice: Advice) -> TextTable:
    tried = sorted(advice.tried, key=lambda each: each.ppr)
    rows = [
        [test, criterion.text, *('{}/{}'.format(*each.within[criterion]) for each in tried if each.test == test)]
        for test in dict.fromkeys(each.test for each in advice.tried)
        for criterion in Criterion
    ]
    heads = ['test', '', *(ppr_text(encoder) for encoder in dict.fromkeys(each.encoder for each in tried))]
    return TextTable('Closed-loop trials within the tolerance', heads, rows)


def _shown_budgets(advice: Advice) -> Dict[str, Budget]:
    """Return by title the budgets of odometry and of the true pose with the encoders of the answers."""
    titled: Dict[str, Budget] = {}
    for test, budgets in advice.budgets.items():
        counts = shown_counts(advice, list(budgets))
        titled[f'{test}, {Criterion.ODOMETRY.text}, {counts:g} counts'] = budgets[counts]
    for answer in advice.imus:
        for test, pair in answer.budgets.items():
            about = f'{test}, {answer.counts:g} counts, {answer.wheels.name} wheels'
            titled.update(zip((f'{about}, without {answer.name}', f'{about}, with {answer.name}'), pair))
    truth = advice.answers.get(Criterion.TRUTH)
    for tried in advice.tried:
        if tried.budget and truth and tried.encoder == truth.encoder:
            title = f'{tried.test}, {Criterion.TRUTH.text}, {ppr_text(tried.encoder)}, {tried.budgeted} trials'
            titled[title] = tried.budget
    return titled


def _rows(budget: Budget) -> List[List[str]]:
    rows = []
    for cause, part in budget.every.items():
        numbers = zip(part.bias * TO_SHOWN, part.std * TO_SHOWN, DECIMALS)
        # Adding zero removes the sign of a rounded zero.
        texts = (
            f'{round(mean, n) + 0.0:+.{n}f}' + (f' ± {abs(std):.{n}f}' if round(std, n) >= 0.0 else '')
            for mean, std, n in numbers
        )
        rows.append([cause, *texts, f'{round(100.0 * budget.position_fractions[cause], 1) + 0.0:.1f}'])
    return rows


def shown_counts(advice: Advice, counts: List[float]) -> float:
    """Return the counts whose odometry budget is shown: those of the answer, or the highest."""
    wanted = advice.answers[Criterion.ODOMETRY].budgeted_counts or max(counts)
    return min(counts, key=lambda each: abs(np.log(each / wanted)))


def answers_text(advice: Advice) -> str:
    """Return the answers and the assumptions in lines that fit the terminal."""
    of_std = '; {:g} %: standard deviation of the ratio of the radii and of the separation, {}'
    stds = ''.join(of_std.format(100.0 * each.std, each.source) for each in advice.shown_wheels if each.std)
    lines = [*(f'{head}: {text}' for head, text in answer_rows(advice)), f'assumes {assumptions_text(advice)}{stds}']
    return filled(lines)


def filled(lines: Sequence[str]) -> str:
    """Wrap indented lines at the width of the terminal."""
    width = (os.isatty(1) and os.get_terminal_size().columns) or PIPE_COLUMNS
    kept = (re.sub(r'(?<=\d) (?=\S)', '\xa0', line) for line in lines)  # numbers stay with their units
    filled = (textwrap.fill(line, width, initial_indent='  ', subsequent_indent='    ') for line in kept)
    return '\n'.join(filled).replace('\xa0', ' ')


def answer_rows(advice: Advice) -> List[Tuple[str, str]]:
    """Return the answers with their heads: odometry by wheels, the best improvement, then poses at the goal."""
    odometry, *at_goal = advice.answers.items()
    shown = {**advice.by_wheels, advice.shown_wheels[0]: odometry[1]}
    rows = [(f'odometry with {wheels.text}', str(shown[wheels])) for wheels in advice.shown_wheels]
    rows.append(('most effective improvement', improvement_text(advice)))
    rows[1:1] = [('lines and gear', odometry[1].lines)] if odometry[1].lines else []
    rows += imu_rows(advice.imus)
    return rows + [(criterion.text, str(answer)) for criterion, answer in at_goal]


def summary(advice: Advice) -> Dict[str, Any]:
    """Return requirement and answers as the pages show them."""
    return {'requirement': str(advice.requirement), 'answers': dict(answer_rows(advice))}


def improvement_text(advice: Advice) -> str:
    """Return what lets the first shown wheels that are a limit meet the requirement; else the encoder does."""
    limited = (each for each in advice.shown_wheels if advice.by_wheels[each].kind is Kind.NOT_THE_LIMIT)
    quality = next(limited, max(advice.shown_wheels, key=lambda each: each != EXACT))
    answer = advice.by_wheels[quality]
    if answer.kind is not Kind.NOT_THE_LIMIT:
        return f'the encoder; {quality.text} are {"barely" if answer.kind is Kind.UNDECIDED else "good"} enough'
    causes = ' and '.join(_improvement(limit, quality) for limit in answer.limits) or 'several causes together'
    better = f'{causes}, then at least {answer.counts:.6g} counts' if answer.counts else causes
    if answer.reach is None:
        return better
    corrected = f'a correction of the pose every {answer.reach.holds_for}'
    is_possible = all(limit.reduced_to * quality.std >= limit.error * BEST_STD for limit in answer.limits)
    return f'{better}; or {corrected}' if is_possible else f'{corrected}; or {better}'


def _improvement(limit: Limit, quality: WheelQuality) -> str:
    """Return the required and the present value of a cause."""
    name = {drive_draws.RADIUS: 'mean radius', drive_draws.SEPARATION: 'separation'}.get(limit.cause)
    if name and quality.std:
        name = 'ratio of the radii' if (limit.cause, limit.axis) == (drive_draws.RADIUS, 'across') else name
        percent = 100.0 * quality.std * (0.5 if name == 'mean radius' else 1.0)
        return f'{name} to {rounded(percent * limit.reduced_to / limit.error):g} % instead of {percent:g} %'
    required, present = (amount_text(error, limit.axis) for error in (limit.reduced_to, limit.error))
    return f'{limit.cause} of {required} instead of {present}'


def assumptions_text(advice: Advice) -> str:
    """Return the assumptions about wheels, slip, floor and route in one line."""
    tests = [curve.draws for curve in advice.curves.curves]
    robot, drives = tests[0].robot, ' and '.join(draws.drive.test for draws in tests)
    intervals = robot.intervals
    if intervals is not None:
        stds, count = np.sqrt(np.diag(robot.calibrated_covariance)), len(intervals.drives)
        keys = 'left_wheel_diameter_m', 'radius_ratio', 'radius_per_separation'
        scale, ratio, turning = (
            'nominal' if key in intervals.undetermined else f'to {100.0 * BOUND * std:.2g} %'
            for key, std in zip(keys, stds)
        )
        wheels = f'wheels and slip as calibrated on {count} drive{"s" if count > 1 else ""}: '
        wheels += f'ratio of radii {ratio}, radius / separation {turning}, scale {scale}'
    else:
        quality = robot.quality or robot.own_quality
        wheels = 'the wheel errors of the robot file' if quality == ROBOT_FILE else quality.text
        wheels += '; the slip of the robot file' if robot.has(drive_draws.SLIP) else '; no slip'
    left_out = ['wheel spin'] * bool(robot.errors.slip.spin_travel)
    left_out += ['floor areas'] * any(draws.drive.requested.test.floor for draws in tests)
    without = f', without {" and ".join(left_out)}' if left_out else ''
    about = f'{wheels}{without}; {drives}{tests[0].drive.origin}'
    rest = f'; with an IMU: {STANDSTILL_S:g} s at rest first, which determine the bias, and'
    return about + (f'{rest} {advice.imus[0].draws} sampled drives' if advice.imus else '')


def closed_form_text(advice: Advice) -> str:
    """Return the counts that quantisation requires, by test."""
    return ', '.join(f'{test} {counts:.0f}' for test, counts in advice.closed_form.items())


def own_encoder_text(advice: Advice) -> str:
    """Return the resolution of the robot's own encoder; '' if unknown."""
    return f"The robot's own encoder has {advice.own_counts:g} counts per wheel turn." if advice.own_counts else ''


def advice_json(advice: Advice) -> Dict[str, Any]:
    """Return the advice as JSON data; lengths in metres, angles in radians."""
    requirement = advice.requirement
    return {
        'version': VERSION,
        'robot': {'name': advice.robot, 'own_ppr': advice.own_counts},
        'requirement': requirement._asdict(),
        'wheels': advice.shown_wheels[0].name,
        'answers': _answers(advice, advice.shown_wheels[0]),
        'answers_by_wheels': {wheels.name: _answers(advice, wheels) for wheels in advice.by_wheels},
        'summary': summary(advice),
        'improvement': improvement_text(advice),
        'assumptions': assumptions_text(advice),
        'closed_form_ppr': advice.closed_form,
        'curves': {curve.test: _curve(curve.errors, requirement) for curve in advice.curves.curves},
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
        'encoders': [_encoder(encoder) for encoder in advice.encoders],
        **({'imus': [_imu(answer, requirement) for answer in advice.imus]} if advice.imus else {}),
    }


def _curve(errors_by_counts: Mapping[float, np.ndarray], requirement: Requirement) -> List[Dict[str, Any]]:
    return [
        {
            'ppr': counts,
            'share': float(np.mean(requirement.within(errors))),
            'interval': share_within(errors, requirement),
            'std': errors.std(axis=0).tolist(),
            'quantiles': {f'{q:g}': np.quantile(np.abs(errors), q, axis=0).tolist() for q in QUANTILES},
        }
        for counts, errors in sorted(errors_by_counts.items())
    ]


def _imu(answer: ImuAnswer, requirement: Requirement) -> Dict[str, Any]:
    """Return an answer; counts above those of any encoder are null."""
    lowest, *interval = _known(answer.smallest)
    return {
        'imu': answer.name,
        'wheels': answer.wheels.name,
        'kind': Kind.FROM if interval[1] else Kind.UNDECIDED if interval[0] else Kind.NOT_THE_LIMIT,
        'smallest_ppr': lowest,
        'interval': interval,
        'text': str(answer),
        'draws': answer.draws,
        'standstill_s': STANDSTILL_S,
        'curves': {
            curve.plain.test: [
                {**each, 'equal_ppr': _known(equal)[0], 'equal_interval': _known(equal)[1:]}
                for each, equal in zip(_curve(curve.errors, requirement), curve.equal.values())
            ]
            for curve in answer.curves
        },
        'budgets': {
            test: {'ppr': answer.counts, 'without': _budget(without), 'with': _budget(with_imu)}
            for test, (without, with_imu) in answer.budgets.items()
        },
    }


def _known(counts: Sequence[float]) -> List[Optional[float]]:
    return [each if math.isfinite(each) else None for each in counts]


def _answers(advice: Advice, wheels: WheelQuality) -> Dict[str, Any]:
    """Return the answers for wheels, with that for the first IMU if there is one."""
    answers = advice.answers if wheels == advice.shown_wheels[0] else {Criterion.ODOMETRY: advice.by_wheels[wheels]}
    first = next((_imu(each, advice.requirement) for each in advice.imus if each.wheels == wheels), {})
    found: Dict[str, Any] = {
        criterion: {
            'kind': answer.kind,
            'smallest_ppr': answer.counts,
            'interval': answer.interval,
            'encoder': answer.encoder or None,
            'limit': [limit._asdict() for limit in answer.limits],
            'reach': answer.reach and answer.reach._asdict(),
            'more_trials': answer.more_trials,
            'undecided_encoder': answer.undecided or None,
            'errors_of': answer.errors_of or None,
            'lines': answer.lines or None,
            'text': str(answer),
        }
        for criterion, answer in answers.items()
    }
    return {**found, 'odometry_with_imu': {key: first[key] for key in OF_IMU}} if first else found


def _encoder(encoder: ListedEncoder) -> Dict[str, Any]:
    about, limits = encoder._asdict(), [limit._asdict() for limit in encoder.limit]
    file = about.pop('real')
    product = {key: file and (getattr(file, key) or None) for key in OF_PRODUCT}
    return {**about, **product, 'is_of_robot': encoder.is_of_robot, 'limit': limits}


def _budget(budget: Budget) -> Dict[str, Any]:
    every = {
        cause: {
            axis: {'bias': bias, 'variance': variance} for axis, bias, variance in zip(AXES, *np.array(part).tolist())
        }
        for cause, part in budget.every.items()
    }
    rest, found, fractions = every.pop('rest'), every.pop('found'), budget.position_fractions
    fractions = {cause: fractions[cause] for cause in every}
    return {'parts': every, 'rest': rest, 'found': found, 'position_fractions': fractions}
