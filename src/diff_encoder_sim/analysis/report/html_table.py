"""Converts tables into what the template shows: texts, in blocks that fit the width of a page."""

from __future__ import annotations

from typing import List, NamedTuple

from diff_encoder_sim.analysis.table import Table, abreast, equal_neighbours, is_number_column, rounded


class Group(NamedTuple):
    """A heading over neighbouring columns; the text is empty over the key columns."""

    text: str
    span: int


class Head(NamedTuple):
    """The heading of a column."""

    text: str
    is_number: bool  # aligned to the right


class Row(NamedTuple):
    """The texts of a row."""

    entries: List[str]
    is_first: bool  # its first entry differs from that of the row above


class Block(NamedTuple):
    """Columns beside each other."""

    groups: List[Group]  # none where the table has none
    heads: List[Head]
    keys: int  # number of key columns
    rows: List[Row]


class HtmlTable(NamedTuple):
    """A table for the template."""

    title: str
    blocks: List[Block]
    notes: List[str]


def html_table(table: Table) -> HtmlTable:
    """Convert a table; numbers are rounded, missing ones a dash."""
    return HtmlTable(table.title, [_block(table, columns) for columns in abreast(table.columns)], table.notes)


def _block(table: Table, indices: List[int]) -> Block:
    columns = [table.columns[index] for index in indices]
    runs = equal_neighbours([column.group for column in columns])
    has_groups = any(text for text, _, _ in runs)
    groups = [Group(text, last - first + 1) for text, first, last in runs] if has_groups else []
    heads = [
        Head(column.head, bool(column.group) or is_number_column(table, index))
        for column, index in zip(columns, indices)
    ]
    keys = sum(not column.group for column in columns) if has_groups else 1
    return Block(groups, heads, keys, _rows(table, indices))


def _rows(table: Table, indices: List[int]) -> List[Row]:
    rows = []
    for number, row in enumerate(table.rows):
        is_first = number > 0 and row[0] != table.rows[number - 1][0]
        rows.append(Row([rounded(row[index], '–') for index in indices], is_first))
    return rows
