"""The proof of the suite: right nodes pass all clauses, and each wrong one fails exactly its clause."""

from functools import partial

import pytest

from diff_encoder_sim.conformance.cases import plan
from diff_encoder_sim.conformance.mapping import Wheels
from diff_encoder_sim.conformance.verdicts import FAIL, NOT_APPLICABLE, judge
from odometry_subjects import ANGLES, COUNTS, FAULTS, OurOdometry, SimpleOdometry, evidence_of, mapping_of

SLOW = ('one hour', 'memory')  # cases that one test plays to right nodes only
ROBOTS = {
    'ALTO': Wheels(),
    'coarse': Wheels(ppr=40.0),
    'Kobuki': Wheels(ppr=2578.33, wheel_diameter=0.0704, wheel_separation=0.23),
    'large': Wheels(ppr=4096.0, wheel_diameter=0.4, wheel_separation=0.9),
    'Burger': Wheels(ppr=4096.0, wheel_diameter=0.066, wheel_separation=0.16),
}


def quick_rounds(inputs, wheels):
    rounds = plan(mapping_of(inputs), wheels)
    return [each._replace(cases=[case for case in each.cases if case.name not in SLOW]) for each in rounds]


def failed(verdicts):
    return {each.clause.number: (each.value, each.allowed) for each in verdicts if each.outcome == FAIL}


@pytest.mark.parametrize('robot', ROBOTS)
@pytest.mark.parametrize(('inputs', 'unseen'), [(COUNTS, {'2.1', '4.5'}), (ANGLES, set())], ids=['counts', 'angles'])
def test_our_odometry_passes_all_clauses(inputs, unseen, robot):
    wheels = ROBOTS[robot]
    rounds = None if robot == 'ALTO' else quick_rounds(inputs, wheels)
    verdicts = judge(evidence_of(OurOdometry, inputs, wheels, rounds))
    assert failed(verdicts) == {}
    assert {each.clause.number for each in verdicts if each.outcome == NOT_APPLICABLE} == {
        *unseen,
        '7.2',
    }  # of a process


@pytest.mark.parametrize('inputs', [COUNTS, ANGLES], ids=['counts', 'angles'])
def test_simple_odometry_passes_all_clauses(inputs):
    assert failed(judge(evidence_of(SimpleOdometry, inputs, rounds=quick_rounds(inputs, Wheels())))) == {}


@pytest.mark.parametrize('fault', FAULTS)
def test_a_wrong_node_fails_exactly_its_clause(fault):
    clause, inputs = FAULTS[fault]
    rounds = quick_rounds(inputs, Wheels())
    verdicts = judge(evidence_of(partial(SimpleOdometry, fault=fault), inputs, rounds=rounds))
    assert [*failed(verdicts)] == [clause], failed(verdicts)


def test_verdicts_do_not_depend_on_the_time_of_the_run():
    rounds = quick_rounds(ANGLES, Wheels())
    for hours in range(4):
        now_ns = 1_700_000_000_000_000_000 + hours * 3_600_123_456_789
        assert failed(judge(evidence_of(OurOdometry, ANGLES, rounds=rounds, now_ns=now_ns))) == {}
