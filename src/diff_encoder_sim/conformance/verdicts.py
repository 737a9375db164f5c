"""Judges all clauses: what odometry must do, by which source, and the effect of a fault on a robot."""

from __future__ import annotations

import csv
import itertools
from typing import Dict, List, NamedTuple, Set

from diff_encoder_sim.base.errors import readable
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.conformance import message_clauses, motion_clauses
from diff_encoder_sim.conformance.clauses import Evidence, NotApplicable, require

MEASURES = {**motion_clauses.MEASURES, **message_clauses.MEASURES}  # by number


class Clause(NamedTuple):
    """A requirement on odometry: a row of config/conformance/suite/clauses.csv."""

    number: str
    title: str
    source: str
    reason: str  # of the tolerance
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
    """Judge all clauses, each after those that it needs."""
    path = package_folder() / 'config' / 'conformance' / 'suite' / 'clauses.csv'
    with open(path, encoding='utf-8', newline='') as file:
        clauses = {row[0]: Clause(*row) for row in itertools.islice(csv.reader(file), 1, None)}
    verdicts: Dict[str, Verdict] = {}
    unjudged: Set[str] = set()  # failed, or behind a failed one

    def judge_one(clause: Clause) -> None:
        for needed in clause.needs.split():
            if needed not in verdicts:
                judge_one(clauses[needed])
        blocking = next((needed for needed in clause.needs.split() if needed in unjudged), '')
        try:
            require(not blocking, f'judged after {blocking} passes')
            found = MEASURES[clause.number](evidence)
            verdict = Verdict(clause, PASS if found.is_met else FAIL, readable(found.value), *found[2:])
        except NotApplicable as reason:
            verdict = Verdict(clause, NOT_APPLICABLE, str(reason))
        verdicts[clause.number] = verdict
        if blocking or verdict.outcome == FAIL:
            unjudged.add(clause.number)

    for each in clauses.values():
        judge_one(each)
    return [verdicts[number] for number in clauses]
