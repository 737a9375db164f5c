"""The encoders that a user can choose from."""

from __future__ import annotations

import math
from typing import Iterator, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.advice.answers import Answer, Kind
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.odometry_curve import share_within
from diff_encoder_sim.advice.requirement import Requirement
from diff_encoder_sim.analysis.sample_statistics import Interval
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.wheels.covariance import PULSE_VARIANCE
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# As many as where the curve crosses what is asked for.
DRAWS = 8000
# So many show that most of the others are not enough.
FEW_DRAWS = 500


class Candidate(NamedTuple):
    """An encoder to choose."""

    label: str
    counts: float  # of an ideal encoder whose readings are as uncertain
    params: EncoderParams
    name: str = ''  # of a real one, or `own of burger`
    price: str = ''  # class of its price


def candidates_of(campaign: Campaign) -> List[Candidate]:
    """Return the encoders of a campaign, from the coarsest to the finest."""
    found = []
    for cell in campaign.cells[: len(campaign.encoders)]:
        params = cell.robot_params.encoder.model_copy(update={'ppr': cell.ppr})
        counts, real, robot = equivalent_counts(params), cell.encoder.real, campaign.robot
        found.append(Candidate(cell.encoder.label, counts, params))
        if real:
            found[-1] = found[-1]._replace(name=real.stem, price=real.price)
        elif robot and robot.ppr and params.ppr == PerWheel(left=robot.ppr, right=robot.ppr):
            found[-1] = found[-1]._replace(name=f'own of {robot.name}')
    return sorted(found, key=lambda candidate: candidate.counts)


def equivalent_counts(params: EncoderParams) -> float:
    """Return how many counts an ideal encoder has whose readings have the mean variance of both wheels'."""
    left, right = (
        counts * math.sqrt(PULSE_VARIANCE / (PULSE_VARIANCE + params.encoder.pulse_variance(counts)))
        for counts in (params.counts_per_turn.left, params.counts_per_turn.right)
    )
    return left if left == right else math.sqrt(2.0 / (left**-2 + right**-2))


def recommended(
    candidates: Sequence[Candidate], answer: Answer, tests: Sequence[DriveDraws], requirement: Requirement
) -> Optional[Candidate]:
    """Return the smallest candidate whose odometry is enough; None where none is, or where an answer names none."""
    if answer.kind is not Kind.FROM:
        return None
    too_few = answer.interval[0] or 0.0
    # Real encoders have errors of their own: those with fewer counts are tried, too.
    possible = [each for each in candidates if each.counts > too_few or each.label != f'{each.counts:g}']
    return smallest_enough(possible, tests, requirement)


def finest_real(candidates: Sequence[Candidate], answer: Answer) -> Optional[Candidate]:
    """Return the best real encoder whose counts are enough; None if there is none.

    If it is not recommended, its own errors are too large.
    """
    enough = answer.interval[1] or 0.0
    real = (each for each in reversed(candidates) if each.params.encoder.counts_per_wheel_turn is not None)
    return next((each for each in real if each.params.counts_per_turn.left >= enough), None)


def smallest_enough(
    candidates: Sequence[Candidate], tests: Sequence[DriveDraws], requirement: Requirement
) -> Optional[Candidate]:
    """Return the first candidate whose odometry meets a requirement for certain; None where none does.

    Args:
        candidates: in the order in which they are tried.
        tests: a drive of each.
        requirement: at the end of each drive.
    """

    def shares(candidate: Candidate, count: int) -> Iterator[Interval]:
        return (share_within(draws.errors([candidate.params], count)[0], requirement) for draws in tests)

    for candidate in candidates:
        is_possible = all(share.high >= requirement.share for share in shares(candidate, FEW_DRAWS))
        if is_possible and all(share.low >= requirement.share for share in shares(candidate, DRAWS)):
            return candidate
    return None
