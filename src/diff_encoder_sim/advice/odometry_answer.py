"""From how many counts on odometry by itself is right at the end of the tests."""

from __future__ import annotations

from typing import Dict, List, Mapping, Sequence

import numpy as np

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit
from diff_encoder_sim.advice.drawn_robot import ROBOTS_CAUSES
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.limits import limits
from diff_encoder_sim.advice.odometry_budget import EDGES, MISSED, SENSOR_ERRORS, encoder_errors, wheel_errors
from diff_encoder_sim.advice.odometry_curve import MOST_COUNTS, OdometryCurves
from diff_encoder_sim.advice.requirement import Requirement
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams


def odometry_answer(curves: OdometryCurves, params: EncoderParams, requirement: Requirement) -> Answer:
    """Return the answer by the curves; `params` are those of the robot's encoder, but for its counts."""
    smallest = curves.smallest(requirement)
    if smallest is not None:
        return Answer(Criterion.ODOMETRY, Kind.FROM, smallest.counts, smallest.interval)
    finest = curves.encoder(curves.counts[-1])
    if curves.share(finest.counts_per_turn.left, requirement).high >= requirement.share:
        note = f'at the edge of what {requirement.share:g} of the draws reach, up to {MOST_COUNTS:g} counts'
        return Answer(Criterion.ODOMETRY, Kind.UNDECIDED, note=note)
    tests = [curve.draws for curve in curves.curves]
    found = _limits(tests, finest, requirement)
    amounts = {limit.cause: limit.reduced_to / limit.error for limit in found}
    of_wheels = {cause: amounts.get(cause.value, amount) for cause, amount in ROBOTS_CAUSES.items()}
    with_less = OdometryCurves(tests, _with_less(params, amounts), of_wheels).smallest(requirement)
    return Answer(Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, with_less and with_less.counts, limits=found)


def _limits(tests: Sequence[DriveDraws], finest: EncoderParams, requirement: Requirement) -> List[Limit]:
    """Return what is too large, of the wheels and of the encoder itself, however many counts it has."""
    alone: Dict[str, Dict[str, np.ndarray]] = {}
    for draws in tests:
        of_wheels = {cause.value: errors for cause, errors in wheel_errors(draws).items() if cause in ROBOTS_CAUSES}
        for cause, errors in {**of_wheels, **encoder_errors(draws, finest)}.items():
            alone.setdefault(cause, {})[draws.drive.test] = errors
    return limits(alone, requirement)


def _with_less(params: EncoderParams, amounts: Mapping[str, float]) -> EncoderParams:
    """Return an encoder with less of its own errors."""
    model = params.encoder
    faults = {key: getattr(model.faults, key) * amounts.get(MISSED, 1.0) for key in ('missed', 'extra')}
    errors = {key: getattr(model, key) * amounts.get(EDGES, 1.0) for key in SENSOR_ERRORS}
    less = model.model_copy(update={**errors, 'faults': model.faults.model_copy(update=faults)})
    return params.model_copy(update={'encoder': less})
