"""The proof of the suite: right nodes pass all clauses, and each wrong one fails exactly its clause."""

import csv
from functools import partial

import pytest

from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.conformance.cases import plan
from diff_encoder_sim.conformance.mapping import Wheels
from diff_encoder_sim.conformance.verdicts import FAIL, MEASURES, NOT_APPLICABLE, judge
from odometry_subjects import (
    ANGLES,
    COUNTS,
    FAULTS,
    OurOdometry,
    SimpleOdometry,
    SlowConnection,
    evidence_of,
    mapping_of,
)

SLOW = ('one hour', 'memory')  # cases that one test plays to right nodes only
ROBOTS = {
    'ALTO': Wheels(),
    'coarse': Wheels(ppr=40.0),
    'Kobuki': Wheels(ppr=2578.33, wheel_diameter=0.0704, wheel_separation=0.23),
    'large': Wheels(ppr=4096.0, wheel_diameter=0.4, wheel_separation=0.9),
    'Burger': Wheels(ppr=4096.0, wheel_diameter=0.066, wheel_separation=0.16),
}


SIMILAR = (*SLOW, 'honest')  # and 80 drives


def quick_rounds(inputs, wheels, without=SLOW):
    """The plan without cases whose names begin so."""
    rounds = plan(mapping_of(inputs), wheels)
    return [each._replace(cases=[case for case in each.cases if not case.name.startswith(without)]) for each in rounds]


def failed(verdicts):
    return {each.clause.number: (each.value, each.allowed) for each in verdicts if each.outcome == FAIL}


@pytest.mark.parametrize('robot', ROBOTS)
@pytest.mark.parametrize(('inputs', 'unseen'), [(COUNTS, {'2.1', '4.5'}), (ANGLES, set())], ids=['counts', 'angles'])
def test_our_odometry_passes_all_clauses(inputs, unseen, robot):
    wheels = ROBOTS[robot]
    rounds = None if robot == 'ALTO' else quick_rounds(inputs, wheels)
    verdicts = judge(evidence_of(OurOdometry, inputs, wheels, rounds))
    assert failed(verdicts) == {}
    not_judged = {each.clause.number for each in verdicts if each.outcome == NOT_APPLICABLE}
    assert not_judged == {*unseen, '7.2'}  # memory is of a process


@pytest.mark.parametrize('inputs', [COUNTS, ANGLES], ids=['counts', 'angles'])
def test_simple_odometry_passes_all_clauses(inputs):
    assert failed(judge(evidence_of(SimpleOdometry, inputs, rounds=quick_rounds(inputs, Wheels())))) == {}


@pytest.mark.parametrize('fault', FAULTS)
def test_a_wrong_node_fails_exactly_its_clause(fault):
    clause, inputs = FAULTS[fault]
    without = {'7.2': 'honest', '7.1': SLOW, '8.3': SLOW, '8.4': SLOW}.get(clause, SIMILAR)
    rounds = quick_rounds(inputs, Wheels(), without)
    verdicts = judge(evidence_of(partial(SimpleOdometry, fault=fault), inputs, rounds=rounds))
    assert [*failed(verdicts)] == [clause], failed(verdicts)


def test_a_node_that_answers_ten_times_is_judged_by_its_last_answer_to_a_case():
    rounds = quick_rounds(COUNTS, Wheels(), SIMILAR)
    verdicts = judge(evidence_of(partial(SlowConnection, fault='ten times'), rounds=rounds))
    assert [*failed(verdicts)] == ['6.7'], failed(verdicts)


@pytest.mark.long
@pytest.mark.parametrize('fault', FAULTS)
@pytest.mark.parametrize('inputs', [COUNTS, ANGLES], ids=['counts', 'angles'])
def test_a_wrong_node_fails_exactly_its_clause_in_all_cases(fault, inputs):
    clause, shown_by = FAULTS[fault]
    if inputs is not shown_by and clause in ('2.1', '3.2', '4.5'):
        pytest.skip('not seen with this input')
    verdicts = judge(evidence_of(partial(SimpleOdometry, fault=fault), inputs))
    assert [*failed(verdicts)] == [clause], failed(verdicts)


START_NS, APART_NS = 1_700_000_000_000_000_000, 3_600_123_456_789


def test_verdicts_do_not_depend_on_the_time_of_the_run():
    for number, wheels in enumerate(list(ROBOTS.values()) * 4):
        rounds = quick_rounds(ANGLES, wheels, SIMILAR)
        evidence = evidence_of(OurOdometry, ANGLES, wheels, rounds, now_ns=START_NS + number * APART_NS)
        assert failed(judge(evidence)) == {}, number


@pytest.mark.long
@pytest.mark.parametrize('robot', ROBOTS)
@pytest.mark.parametrize('inputs', [COUNTS, ANGLES], ids=['counts', 'angles'])
def test_all_verdicts_are_the_same_at_twenty_times(robot, inputs):
    wheels, outcomes = ROBOTS[robot], set()
    rounds = quick_rounds(inputs, wheels)
    for number in range(20):
        evidence = evidence_of(OurOdometry, inputs, wheels, rounds, now_ns=START_NS + number * APART_NS)
        outcomes.add(tuple(verdict.outcome for verdict in judge(evidence)))
    assert len(outcomes) == 1 and FAIL not in outcomes.pop()


def test_all_clauses_are_measured_and_need_others_of_the_file():
    verdicts = judge(evidence_of(partial(SimpleOdometry, fault='never answers')))
    file = package_folder() / 'config' / 'conformance' / 'suite' / 'clauses.csv'
    rows = list(csv.DictReader(file.read_text(encoding='utf-8').splitlines()))
    numbers = [row['number'] for row in rows]
    assert sorted(numbers) == [each.clause.number for each in verdicts] == sorted(MEASURES)
    for row in rows:
        assert set(row['needs'].split()) <= set(numbers) - {row['number']}, row
    # Nothing else can be judged of a node that never answers.
    assert [each.outcome for each in verdicts] == [FAIL] + [NOT_APPLICABLE] * (len(rows) - 1)
