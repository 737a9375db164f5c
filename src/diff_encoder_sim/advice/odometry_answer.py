"""Lowest counts at which odometry is within the tolerance at the end of the tests, and its error budgets."""

from __future__ import annotations

from typing import Dict, List, Mapping, Optional, Sequence

import numpy as np

from diff_encoder_sim.advice import answers
from diff_encoder_sim.advice.answers import Answer, Budget, Criterion, Kind, Limit, Requirement, part_of
from diff_encoder_sim.advice.drive_draws import ALL_CAUSES, ROBOTS_CAUSES, Amounts, DriveDraws, WheelCause
from diff_encoder_sim.advice.odometry_curve import DRAWS, MOST_COUNTS, OdometryCurves, counts_by_ppr, share_within
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

QUANTISATION, EDGES, MISSED = 'quantisation', 'edge errors', 'missed counts'
ENCODER_CAUSES = (EDGES, MISSED)  # besides quantisation

# Encoder parameters that cause EDGES in proportion to their values; UNEVEN_LINES also cause EDGES.
SENSOR_ERRORS = (
    *('edge_error', 'sensor_error', 'eccentricity', 'first_harmonic', 'second_harmonic'),
    *('noise', 'hysteresis', 'backlash'),
)
UNEVEN_LINES = ('duty_cycle', 'phase_error')

BUDGET_DRAWS = 1000

# (draws, 3) odometry errors by AXES, by cause.
ByCause = Dict[str, np.ndarray]


def odometry_budgets(draws: DriveDraws, encoders: Sequence[EncoderParams]) -> List[Budget]:
    """Return the error budget with each encoder.

    Slip on the simulated floor is a separate part because it belongs to the simulator, not to the robot.
    """
    count = len(encoders)
    of_encoders = [*map(_ideal, encoders), *map(_without_faults, encoders), *encoders]
    bare, *errors = _errors(draws, [None, *of_encoders], {})
    found = _errors(draws, encoders, ALL_CAUSES)
    of_wheels = {cause: part_of(by_cause) for cause, by_cause in wheel_errors(draws).items()}
    budgets = []
    for index, (encoder, total) in enumerate(zip(encoders, found)):
        ideal, sound, faulty = errors[index::count]
        parts = {QUANTISATION: part_of(ideal - bare)}
        if _without_faults(encoder).encoder != IDEAL_ENCODER:
            # Edge errors interact with quantisation, so their variance is a difference of variances.
            parts[EDGES] = answers.added(sound, ideal)
        if encoder.encoder.faults != NO_FAULTS:
            parts[MISSED] = part_of(faulty - sound)
        budgets.append(Budget({**parts, **of_wheels}, part_of(total)))
    return budgets


def wheel_errors(draws: DriveDraws) -> ByCause:
    """Return the odometry errors that only one wheel error causes; they do not depend on the encoder."""
    (bare,) = _errors(draws, [None], {})
    return {
        cause.value: _errors(draws, [None], {cause: 1.0})[0] - bare for cause in WheelCause if draws.robot.has(cause)
    }


def encoder_errors(draws: DriveDraws, encoder: EncoderParams, count: Optional[int] = None) -> ByCause:
    """Return the odometry errors by kind of encoder error, except quantisation."""
    of_steps, sound, faulty = _errors(draws, [_ideal(encoder), _without_faults(encoder), encoder], {}, count)
    found = {EDGES: sound - of_steps, MISSED: faulty - sound}
    return {cause: errors for cause, errors in found.items() if errors.any()}


def _errors(
    draws: DriveDraws, encoders: Sequence[Optional[EncoderParams]], amounts: Amounts, count: Optional[int] = None
) -> List[np.ndarray]:
    goal, count = draws.drive.goal_in_map, BUDGET_DRAWS if count is None else count
    return [answers.along_goal(errors, goal) for errors in draws.errors(encoders, count, amounts)]


def _ideal(encoder: EncoderParams) -> EncoderParams:
    """Return an error-free encoder with the same counts."""
    return encoder.model_copy(update={'ppr': encoder.counts_per_turn, 'encoder': IDEAL_ENCODER})


def _without_faults(encoder: EncoderParams) -> EncoderParams:
    return encoder.model_copy(update={'encoder': encoder.encoder.model_copy(update={'faults': NO_FAULTS})})


def odometry_answer(curves: OdometryCurves, requirement: Requirement) -> Answer:
    """Return the answer from the curves."""
    smallest = curves.smallest(requirement)
    if smallest is not None:
        return Answer(Criterion.ODOMETRY, Kind.FROM, smallest.counts, smallest.interval)
    finest = curves.encoder(curves.counts[-1])
    if curves.share(finest.counts_per_turn.left, requirement).high >= requirement.share:
        note = f'success rate near {requirement.share:g} at up to {MOST_COUNTS:g} counts'
        return Answer(Criterion.ODOMETRY, Kind.UNDECIDED, note=note)
    return limited_answer([curve.draws for curve in curves.curves], finest, requirement)


def limited_answer(tests: Sequence[DriveDraws], params: EncoderParams, requirement: Requirement) -> Answer:
    """Return the answer for an encoder whose counts suffice but whose errors are too large."""
    # Whether an encoder without quantisation and errors meets the requirement on these wheels.
    shares = [share_within(draws.errors([None], DRAWS, ROBOTS_CAUSES)[0], requirement) for draws in tests]
    is_its_own = all(share.low >= requirement.share for share in shares)
    of_wheels: Dict[str, ByCause] = {}
    for draws in tests:
        for cause, errors in wheel_errors(draws).items():
            if cause != WheelCause.CONTACT.value:
                of_wheels.setdefault(cause, {})[draws.drive.test] = errors
    found = answers.limits(of_wheels, requirement) + own_limits(tests, params, requirement, is_its_own)
    found.sort(key=lambda limit: -limit.error / limit.tolerance)
    amounts = {limit.cause: limit.reduced_to / limit.error for limit in found}
    on_wheels = {cause: amounts.get(cause.value, amount) for cause, amount in ROBOTS_CAUSES.items()}
    with_less = OdometryCurves(tests, _with_less(counts_by_ppr(params), amounts), on_wheels).smallest(requirement)
    return Answer(
        Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, with_less and with_less.counts, limits=found, of_encoder=is_its_own
    )


def own_limits(
    tests: Sequence[DriveDraws],
    encoder: EncoderParams,
    requirement: Requirement,
    is_too_much: bool,
    count: Optional[int] = None,
) -> List[Limit]:
    """Return the encoder errors that are too large; if only their sum is too large, the worst one."""
    by_cause: Dict[str, ByCause] = {}
    for draws in tests:
        for cause, errors in encoder_errors(draws, encoder, count).items():
            by_cause.setdefault(cause, {})[draws.drive.test] = errors
    found = answers.limits(by_cause, requirement)
    return found if found or not is_too_much else answers.worst_halved(by_cause, requirement)


def _with_less(params: EncoderParams, amounts: Mapping[str, float]) -> EncoderParams:
    """Return the encoder with its errors reduced to these fractions."""
    model = params.encoder
    faults = {key: getattr(model.faults, key) * amounts.get(MISSED, 1.0) for key in ('missed', 'extra')}
    errors = {key: getattr(model, key) * amounts.get(EDGES, 1.0) for key in SENSOR_ERRORS}
    less = model.model_copy(update={**errors, 'faults': model.faults.model_copy(update=faults)})
    return params.model_copy(update={'encoder': less})
