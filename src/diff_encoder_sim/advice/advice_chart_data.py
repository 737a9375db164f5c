"""The data of an advice's charts: rows of numbers and texts."""

from __future__ import annotations

from typing import Any, Dict, List

import numpy as np

from diff_encoder_sim.advice.advice import Advice
from diff_encoder_sim.advice.advice_tables import DECIMALS, TO_SHOWN
from diff_encoder_sim.advice.answers import AXES, Budget, Criterion, along_goal
from diff_encoder_sim.advice.encoder_search import fraction_interval
from diff_encoder_sim.advice.odometry_curve import FEWEST_COUNTS, MOST_COUNTS

UNITS = ('mm', 'mm', 'degrees')

# A logarithmic axis has no zero, and smaller bars cannot be seen [mm, degrees].
SMALLEST_ERROR = 1e-4

# Of which the closed form is drawn.
SHARES = np.round(np.linspace(0.02, 0.99, 98), 2)

# Dots of equal counts stand side by side: on a logarithmic axis by a factor.
BESIDE = {Criterion.ODOMETRY: 1 / 1.1, Criterion.POSE_ESTIMATE: 1.0, Criterion.TRUTH: 1.1}

Rows = List[Dict[str, Any]]


def chart_data(advice: Advice) -> Dict[str, Rows]:
    """Return the rows by name."""
    return {
        'curves': _curve_rows(advice),
        'closed': _closed_form_rows(advice),
        'errors': _error_rows(advice),
        'trials': _trial_rows(advice),
        'encoders': _encoder_rows(advice),
        'budget': _budget_rows(advice),
    }


def _curve_rows(advice: Advice) -> Rows:
    return [
        {
            'test': curve.test,
            'criterion': Criterion.ODOMETRY.text,
            'counts': counts,
            'share': round(float(np.mean(advice.requirement.within(errors))), 4),
        }
        for curve in advice.curves.curves
        for counts, errors in sorted(curve.errors.items())
    ]


def _closed_form_rows(advice: Advice) -> Rows:
    asked = [advice._replace(requirement=advice.requirement._replace(share=float(share))) for share in SHARES]
    return [
        {'test': test, 'counts': float(f'{counts:.4g}'), 'share': each.requirement.share}
        for each in asked
        for test, counts in each.closed_form.items()
        if FEWEST_COUNTS <= counts <= MOST_COUNTS
    ]


def _error_rows(advice: Advice) -> Rows:
    share = advice.requirement.share
    lines = {'half': 0.5, f'{100.0 * share:g} %': share, '95 %': 0.95}
    rows: Rows = []
    for curve in advice.curves.curves:
        for counts, errors in sorted(curve.errors.items()):
            shown = np.abs(along_goal(errors, curve.draws.drive.goal_in_map)) * TO_SHOWN
            for line, level in lines.items():
                of_axes = np.maximum(np.quantile(shown, level, axis=0), SMALLEST_ERROR)
                rows += [
                    {'test': curve.test, 'counts': counts, 'line': line, 'axis': axis, 'error': float(f'{error:.4g}')}
                    for axis, error in zip(AXES, of_axes)
                ]
    return rows


def _trial_rows(advice: Advice) -> Rows:
    rows = []
    for tried in advice.tried:
        for criterion, counts in tried.within.items():
            interval = fraction_interval(counts, advice.requirement.confidence)
            rows.append(
                {
                    'test': tried.test,
                    'encoder': tried.label,
                    'counts': tried.counts * BESIDE[criterion],
                    'criterion': criterion.text,
                    'share': round(counts.fraction, 4),
                    'low': round(interval.low, 4),
                    'high': round(interval.high, 4),
                    'trials': f'{counts.within} of {counts.trials}',
                }
            )
    return rows


def _encoder_rows(advice: Advice) -> Rows:
    return [
        {
            'encoder': encoder.name,
            'counts': round(encoder.counts, 3),
            'share': round(sum(encoder.share) / 2.0, 4),
            'trials': encoder.share_text,
        }
        for encoder in advice.encoders
    ]


def _budget_rows(advice: Advice) -> Rows:
    rows = []
    for test, budgets in advice.budgets.items():
        for counts, budget in budgets.items():
            rows += _bars(test, Criterion.ODOMETRY, f'{counts:g}', counts, budget)
    for tried in advice.tried:
        if tried.truth:
            rows += _bars(tried.test, Criterion.TRUTH, tried.label, tried.counts, tried.truth)
    return rows


def _bars(test: str, criterion: Criterion, label: str, counts: float, budget: Budget) -> Rows:
    """Return the bars of one encoder: parts of the root mean square, in proportion to the mean squares."""
    named = {**budget.parts, 'rest': budget.rest}
    squares = {cause: np.maximum(part.bias**2 + part.variance, 0.0) for cause, part in named.items()}
    total = np.maximum(sum(squares.values()), 1e-18)
    heights = {cause: square / np.sqrt(total) * TO_SHOWN for cause, square in squares.items()}
    return [
        {
            'test': test,
            'criterion': criterion.value,
            'encoder': label,
            'counts': counts,
            'cause': cause,
            'axis': axis,
            'rms': float(f'{heights[cause][index]:.4g}'),
            'mean': f'{part.bias[index] * TO_SHOWN[index]:.{DECIMALS[index]}f} {UNITS[index]}',
            'deviation': f'{part.std[index] * TO_SHOWN[index]:.{DECIMALS[index]}f} {UNITS[index]}',
        }
        for cause, part in named.items()
        for index, axis in enumerate(AXES)
        if heights[cause][index] >= SMALLEST_ERROR  # or only the legend would have it
    ]
