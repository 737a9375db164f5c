"""Results of checks, and their table."""

from __future__ import annotations

from typing import NamedTuple, Sequence

from tabulate import tabulate


class Check(NamedTuple):
    """One thing that was checked."""

    name: str
    value: str
    is_ok: bool
    advice: str  # what to do; '' where there is nothing


def checks_table(checks: Sequence[Check]) -> str:
    """Format checks as a table, and below it what to do."""
    rows = [[check.name, check.value, 'ok' if check.is_ok else 'NOT OK'] for check in checks]
    table = tabulate(rows, ['check', 'value', ''], disable_numparse=True)
    advice = [f'{check.name}: {check.advice}' for check in checks if check.advice]
    return '\n'.join([table, *([''] if advice else []), *advice])
