"""From how many counts on odometry by itself is right at the end of the tests."""

from __future__ import annotations

from typing import Dict, List, Mapping, Sequence

import numpy as np

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit
from diff_encoder_sim.advice.drawn_robot import ROBOTS_CAUSES
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.limits import limits, worst_halved
from diff_encoder_sim.advice.odometry_budget import DRAWS as BUDGET_DRAWS
from diff_encoder_sim.advice.odometry_budget import EDGES, MISSED, SENSOR_ERRORS, encoder_errors, wheel_errors
from diff_encoder_sim.advice.odometry_curve import DRAWS, MOST_COUNTS, OdometryCurves, counts_by_ppr, share_within
from diff_encoder_sim.advice.requirement import Requirement
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def odometry_answer(curves: OdometryCurves, requirement: Requirement) -> Answer:
    """Return the answer by the curves."""
    smallest = curves.smallest(requirement)
    if smallest is not None:
        return Answer(Criterion.ODOMETRY, Kind.FROM, smallest.counts, smallest.interval)
    finest = curves.encoder(curves.counts[-1])
    if curves.share(finest.counts_per_turn.left, requirement).high >= requirement.share:
        note = f'at the edge of what {requirement.share:g} of the draws reach, up to {MOST_COUNTS:g} counts'
        return Answer(Criterion.ODOMETRY, Kind.UNDECIDED, note=note)
    return limited_answer([curve.draws for curve in curves.curves], finest, requirement)


def limited_answer(tests: Sequence[DriveDraws], params: EncoderParams, requirement: Requirement) -> Answer:
    """Return the answer for an encoder that is not enough although its counts are."""
    is_its_own = _is_ideal_enough(tests, requirement)
    found = _limits(tests, params, requirement, is_its_own)
    amounts = {limit.cause: limit.reduced_to / limit.error for limit in found}
    of_wheels = {cause: amounts.get(cause.value, amount) for cause, amount in ROBOTS_CAUSES.items()}
    with_less = OdometryCurves(tests, _with_less(counts_by_ppr(params), amounts), of_wheels).smallest(requirement)
    return Answer(
        Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, with_less and with_less.counts, limits=found, of_encoder=is_its_own
    )


def _is_ideal_enough(tests: Sequence[DriveDraws], requirement: Requirement) -> bool:
    """Return whether an encoder without steps and errors meets the requirement, as the wheels are."""
    shares = (share_within(draws.errors([None], DRAWS, ROBOTS_CAUSES)[0], requirement) for draws in tests)
    return all(share.low >= requirement.share for share in shares)


def _limits(
    tests: Sequence[DriveDraws], encoder: EncoderParams, requirement: Requirement, is_its_own: bool
) -> List[Limit]:
    """Return the errors that are too large, of the wheels and of the encoder itself, whatever its counts."""
    of_wheels: Dict[str, Dict[str, np.ndarray]] = {}
    for draws in tests:
        for cause, errors in wheel_errors(draws).items():
            if cause in ROBOTS_CAUSES:
                of_wheels.setdefault(cause.value, {})[draws.drive.test] = errors
    found = limits(of_wheels, requirement) + own_limits(tests, encoder, requirement, is_its_own)
    return sorted(found, key=lambda limit: -limit.error / limit.tolerance)


def own_limits(
    tests: Sequence[DriveDraws],
    encoder: EncoderParams,
    requirement: Requirement,
    is_too_much: bool,
    count: int = BUDGET_DRAWS,
) -> List[Limit]:
    """Return the errors of an encoder that are too large; if they are too much together, at least the worst one."""
    alone: Dict[str, Dict[str, np.ndarray]] = {}
    for draws in tests:
        for cause, errors in encoder_errors(draws, encoder, count).items():
            alone.setdefault(cause, {})[draws.drive.test] = errors
    found = limits(alone, requirement)
    return found if found or not is_too_much else worst_halved(alone, requirement)


def _with_less(params: EncoderParams, amounts: Mapping[str, float]) -> EncoderParams:
    """Return an encoder with less of its own errors."""
    model = params.encoder
    faults = {key: getattr(model.faults, key) * amounts.get(MISSED, 1.0) for key in ('missed', 'extra')}
    errors = {key: getattr(model, key) * amounts.get(EDGES, 1.0) for key in SENSOR_ERRORS}
    less = model.model_copy(update={**errors, 'faults': model.faults.model_copy(update=faults)})
    return params.model_copy(update={'encoder': less})
