"""Verdicts as a table for the terminal, and as JUnit XML for rostest and CI."""

from __future__ import annotations

import textwrap
from typing import Sequence
from xml.etree import ElementTree

from diff_encoder_sim.analysis.result_tables import TextTable
from diff_encoder_sim.conformance.verdicts import FAIL, NOT_APPLICABLE, PASS, Verdict

MEASURED_COLUMNS, ALLOWED_COLUMNS = 40, 20  # the table has at most 120 columns


def verdict_table(verdicts: Sequence[Verdict]) -> str:
    """Return a table of all clauses, the effect of each failed one, and the counts, for the terminal."""
    rows = [
        [
            *(each.clause.number, each.clause.title, each.outcome),
            textwrap.fill(each.value, MEASURED_COLUMNS),
            textwrap.fill(each.allowed, ALLOWED_COLUMNS),
        ]
        for each in verdicts
    ]
    table = TextTable('Conformance', ['', 'clause', 'verdict', 'measured', 'allowed'], rows, texts=5).text()
    failed = [each.clause for each in verdicts if each.outcome == FAIL]
    effects = [f'{clause.number} {clause.title}: {clause.effect} ({clause.source})' for clause in failed]
    return '\n'.join([table, '', *effects, counts(verdicts)])


def counts(verdicts: Sequence[Verdict]) -> str:
    """Return the number of verdicts of each kind."""
    outcomes = [each.outcome for each in verdicts]
    return ', '.join(f'{outcomes.count(outcome)} {outcome}' for outcome in (PASS, FAIL, NOT_APPLICABLE))


def junit_xml(verdicts: Sequence[Verdict], name: str, seconds: float) -> bytes:
    """Return a JUnit test suite with a test case for each clause; `name` is that of the node."""
    outcomes = [each.outcome for each in verdicts]
    numbers = {'tests': len(verdicts), 'failures': outcomes.count(FAIL), 'skipped': outcomes.count(NOT_APPLICABLE)}
    about = {'name': name, 'errors': '0', 'time': f'{seconds:.3f}', **{key: str(n) for key, n in numbers.items()}}
    suite = ElementTree.Element('testsuite', about)
    for each in verdicts:
        title = f'{each.clause.number} {each.clause.title}'
        case = ElementTree.SubElement(suite, 'testcase', classname=f'conformance.{name}', name=title, time='0')
        if each.outcome == FAIL:
            message = f'{each.value}; allowed: {each.allowed}'
            failure = ElementTree.SubElement(case, 'failure', type='conformance', message=message)
            failure.text = f'{message}. {each.clause.effect} ({each.clause.source})'  # rosunit reads either
        elif each.outcome == NOT_APPLICABLE:
            ElementTree.SubElement(case, 'skipped', message=each.value)
    content: bytes = ElementTree.tostring(suite, encoding='utf-8', xml_declaration=True)
    return content
