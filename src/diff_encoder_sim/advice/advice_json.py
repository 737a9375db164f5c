"""Advice as JSON, for programs; docs/which_encoder.md describes its keys."""

from __future__ import annotations

from typing import Any, Dict, List

import numpy as np

from diff_encoder_sim.advice.advice import Advice, TriedEncoder
from diff_encoder_sim.advice.answers import Answer, Limit
from diff_encoder_sim.advice.budget import AXES, Budget, Part
from diff_encoder_sim.advice.listed_encoders import ListedEncoder
from diff_encoder_sim.advice.odometry_curve import Curve, share_within
from diff_encoder_sim.advice.requirement import Requirement

VERSION = 1
QUANTILES = (0.5, 0.8, 0.95)


def advice_json(advice: Advice) -> Dict[str, Any]:
    """Return the content; lengths in metres, angles in radians."""
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
