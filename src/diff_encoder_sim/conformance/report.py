"""Verdicts as a table for the terminal, and as JUnit XML for rostest and CI."""

from __future__ import annotations

import textwrap
from collections import Counter
from typing import List, Sequence
from xml.etree import ElementTree

from diff_encoder_sim.analysis.text_tables import TextTable
from diff_encoder_sim.conformance.verdicts import FAIL, NOT_APPLICABLE, PASS, Verdict

VALUE_COLUMNS, ALLOWED_COLUMNS = 44, 24
HEADS = ['clause', '', 'verdict', 'measured', 'allowed']


def conclusion(verdicts: Sequence[Verdict]) -> str:
    """Return the numbers of verdicts."""
    counts = Counter(verdict.outcome for verdict in verdicts)
    return ', '.join(f'{counts[outcome]} {outcome}' for outcome in (PASS, FAIL, NOT_APPLICABLE))


def verdict_rows(verdicts: Sequence[Verdict]) -> List[List[str]]:
    """Return one row per clause: number, clause, verdict, measured, allowed."""
    return [[each.clause.number, each.clause.title, each.outcome, each.value, each.allowed] for each in verdicts]


def effects(verdicts: Sequence[Verdict]) -> List[str]:
    """Return one line for each failed clause: its source, and the effect of the fault on a robot."""
    failed = [verdict.clause for verdict in verdicts if verdict.outcome == FAIL]
    return [f'{each.number} {each.title} ({each.source}): {each.effect}' for each in failed]


def verdict_table(verdicts: Sequence[Verdict]) -> str:
    """Return all verdicts as text for the terminal."""
    rows = [
        [*row[:3], textwrap.fill(row[3], VALUE_COLUMNS), textwrap.fill(row[4], ALLOWED_COLUMNS)]
        for row in verdict_rows(verdicts)
    ]
    table = TextTable('', HEADS, rows, texts=len(HEADS)).text().lstrip()
    return '\n'.join([table, '', *(textwrap.fill(line, 118) for line in effects(verdicts)), conclusion(verdicts)])


def junit_xml(verdicts: Sequence[Verdict], name: str, seconds: float) -> bytes:
    """Return a test suite of JUnit with one test case per clause."""
    counts = Counter(verdict.outcome for verdict in verdicts)
    about = {'tests': len(verdicts), 'failures': counts[FAIL], 'errors': 0, 'skipped': counts[NOT_APPLICABLE]}
    suite = ElementTree.Element('testsuite', {'name': name, **{key: str(value) for key, value in about.items()}})
    suite.set('time', f'{seconds:.1f}')
    for verdict in verdicts:
        clause = verdict.clause
        case = ElementTree.SubElement(suite, 'testcase', classname=f'conformance.{name}', time='0')
        case.set('name', f'{clause.number} {clause.title}')
        if verdict.outcome == FAIL:
            message = f'measured {verdict.value}; allowed {verdict.allowed}'
            ElementTree.SubElement(case, 'failure', type='conformance', message=message).text = clause.effect
        elif verdict.outcome == NOT_APPLICABLE:
            ElementTree.SubElement(case, 'skipped', message=verdict.value)
    return b'<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(suite)
