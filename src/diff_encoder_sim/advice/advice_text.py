"""Advice for the terminal."""

from __future__ import annotations

from tabulate import tabulate

from diff_encoder_sim.advice.advice import Advice
from diff_encoder_sim.advice.advice_tables import AdviceTable, advice_tables


def answers_text(advice: Advice) -> str:
    """Return a line for each criterion."""
    return '\n'.join(f'  {criterion.text}: {answer}' for criterion, answer in advice.answers.items())


def closed_form_text(advice: Advice) -> str:
    """Return what quantisation alone asks for."""
    return ', '.join(f'{test} {counts:.0f}' for test, counts in advice.closed_form.items())


def own_encoder_text(advice: Advice) -> str:
    """Say how many counts the robot's own encoder has; nothing where nobody says it."""
    return f"The robot's own encoder has {advice.own_counts:g} PPR." if advice.own_counts else ''


def tables_text(advice: Advice) -> str:
    """Return the tables."""
    return '\n\n'.join(map(_table_text, advice_tables(advice)))


def _table_text(table: AdviceTable) -> str:
    aligned = ['left'] * table.keys + ['right'] * (len(table.heads) - table.keys)
    text = tabulate(table.rows, table.heads, disable_numparse=True, colalign=aligned)
    return '\n'.join([table.title, text, *([table.note] if table.note else [])])
