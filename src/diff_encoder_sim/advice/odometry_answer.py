"""From how many counts on odometry by itself is right at the end of the tests."""

from __future__ import annotations

from typing import Dict, List, Tuple

import numpy as np

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit
from diff_encoder_sim.advice.drawn_robot import Amounts, WheelCause
from diff_encoder_sim.advice.limits import limits
from diff_encoder_sim.advice.odometry_budget import wheel_errors
from diff_encoder_sim.advice.odometry_curve import MOST_COUNTS, OdometryCurves
from diff_encoder_sim.advice.requirement import Requirement
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams


def odometry_answer(curves: OdometryCurves, params: EncoderParams, requirement: Requirement) -> Answer:
    """Return the answer by the curves; `params` are those of the robot's encoder, but for its counts."""
    smallest = curves.smallest(requirement)
    if smallest is not None:
        return Answer(Criterion.ODOMETRY, Kind.FROM, smallest.counts, smallest.interval)
    share = curves.share_without_steps(requirement)
    if share.high >= requirement.share:
        note = f'at the edge of what {requirement.share:g} of the draws reach, up to {MOST_COUNTS:g} counts'
        return Answer(Criterion.ODOMETRY, Kind.UNDECIDED, note=note)
    found, amounts = _limits(curves, requirement)
    with_less = OdometryCurves([curve.draws for curve in curves.curves], params, amounts).smallest(requirement)
    return Answer(Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, with_less and with_less.counts, limits=found)


def _limits(curves: OdometryCurves, requirement: Requirement) -> Tuple[List[Limit], Amounts]:
    """Return what is too large, and how much of it would not be."""
    alone: Dict[WheelCause, Dict[str, np.ndarray]] = {}
    for curve in curves.curves:
        for cause, errors in wheel_errors(curve.draws).items():
            alone.setdefault(cause, {})[curve.test] = errors
    found = limits({cause.value: of_tests for cause, of_tests in alone.items()}, requirement)
    reduced = {limit.cause: limit.reduced_to / limit.error for limit in found}
    return found, {cause: reduced.get(cause.value, 1.0) for cause in WheelCause}
