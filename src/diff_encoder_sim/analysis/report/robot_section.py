"""The robot of a campaign: what was found out about it, and whether it drives as it should."""

from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.report.html_table import HtmlTable, html_table
from diff_encoder_sim.analysis.table import Column, Table


class RobotSection(NamedTuple):
    """What the template shows of the robot."""

    name: str
    file: str
    conclusion: str
    checks: Optional[HtmlTable]  # None where none was made
    found: HtmlTable
    settings: Optional[HtmlTable]  # None where the robot file sets nothing
    warnings: List[str]
    notes: List[str]


def robot_section(dataset: Dataset) -> Optional[RobotSection]:
    """Return the section of a campaign's robot; None of bags, and of campaigns before robots had one."""
    robot = (dataset.manifest or {}).get('robot')
    if not isinstance(robot, dict):
        return None
    try:
        return _section(robot)
    except (KeyError, TypeError, AttributeError):  # a manifest that somebody has edited
        return None


def _section(robot: Dict[str, Any]) -> RobotSection:
    checks, settings = robot['checks'], robot['set']
    failed = [check['name'] for check in checks if not check['is_ok']]
    return RobotSection(
        str(robot['name']),
        str(robot['file']),
        _conclusion(len(checks), failed),
        _table('Self-check', ('check', 'value', 'result'), [_check_row(check) for check in checks]) if checks else None,
        _table('Found', ('found', 'value', 'source'), [_found_row(found) for found in robot['found']]),
        _table('Set in its file', ('parameter', 'value'), [[key, str(settings[key])] for key in settings])
        if settings
        else None,
        [str(warning) for warning in robot['warnings']],
        [str(note) for note in robot['notes']],
    )


def _conclusion(count: int, failed: List[str]) -> str:
    if not count:
        return 'It was not checked.'
    if failed:
        return f'Its self-check failed ({", ".join(failed)}): these results are not those of the real robot.'
    return f'It passed all {count} checks of its self-check.'


def _check_row(check: Dict[str, Any]) -> List[str]:
    return [str(check['name']), str(check['value']), 'ok' if check['is_ok'] else f'NOT OK: {check["advice"]}']


def _found_row(found: Dict[str, Any]) -> List[str]:
    return [str(found[key]) for key in ('quantity', 'value', 'source')]


def _table(title: str, heads: Sequence[str], rows: List[List[str]]) -> HtmlTable:
    return html_table(Table('', title, [Column(head, head) for head in heads], [list(row) for row in rows], []))
