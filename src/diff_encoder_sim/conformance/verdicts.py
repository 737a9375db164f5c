"""Judges all clauses: what odometry must do, by which source, and the effect of a fault on a robot."""

from __future__ import annotations

import csv
import itertools
from typing import Dict, List, NamedTuple, Set

from diff_encoder_sim.base.errors import readable
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.conformance import message_clauses, motion_clauses
from diff_encoder_sim.conformance.clauses import Evidence, NotApplicable

MEASURES = {**motion_clauses.MEASURES, **message_clauses.MEASURES}  # by number


class Clause(NamedTuple):
    """A requirement on odometry: a row of config/conformance/clauses.csv."""

    number: str
    title: str
    source: str
    effect: str  # of a fault on a robot
    needs: str  # numbers of the clauses without which this one cannot be judged


class Verdict(NamedTuple):
    """Judgement of a clause."""

    clause: Clause
    outcome: str  # pass, fail, or not applicable
    value: str  # measured, or why it is not applicable
    allowed: str = ''
    case: str = ''


PASS, FAIL, NOT_APPLICABLE = 'pass', 'fail', 'not applicable'


def judge(evidence: Evidence) -> List[Verdict]:
    """Judge all clauses in the order of the file, in which each follows those it needs; return them by number."""
    with open(package_folder() / 'config' / 'conformance' / 'clauses.csv', encoding='utf-8', newline='') as file:
        clauses = [Clause(*row) for row in itertools.islice(csv.reader(file), 1, None)]
    verdicts: Dict[str, Verdict] = {}
    unjudged: Set[str] = set()  # failed, or behind a failed one
    for each in clauses:
        blocking = next((number for number in each.needs.split() if number in unjudged), '')
        try:
            if blocking:
                raise NotApplicable(f'judged after {blocking} passes')
            found = MEASURES[each.number](evidence)
            verdicts[each.number] = Verdict(each, PASS if found.is_met else FAIL, readable(found.value), *found[2:])
        except NotApplicable as reason:
            verdicts[each.number] = Verdict(each, NOT_APPLICABLE, str(reason))
        if blocking or verdicts[each.number].outcome == FAIL:
            unjudged.add(each.number)
    return sorted(verdicts.values(), key=lambda verdict: verdict.clause.number)
