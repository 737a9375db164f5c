"""Tables as the page shows them: texts, in blocks that fit the width of a page."""

from __future__ import annotations

from typing import List, NamedTuple

from diff_encoder_sim.analysis.table_files import Table, abreast, equal_neighbours, is_number_column, rounded


class Group(NamedTuple):
    """A head over neighbouring columns; the text is empty over those that rows are known by."""

    text: str
    span: int


class Head(NamedTuple):
    """Of one column."""

    text: str
    is_number: bool  # its entries stand to the right


class Row(NamedTuple):
    """A row's texts."""

    entries: List[str]
    is_first: bool  # of those with an equal first entry


class Block(NamedTuple):
    """Columns that stand beside each other."""

    groups: List[Group]  # none where the table has none
    heads: List[Head]
    keys: int  # so many columns say what the row is about
    rows: List[Row]


class HtmlTable(NamedTuple):
    """A table for the template."""

    title: str
    blocks: List[Block]
    notes: List[str]


def html_table(table: Table) -> HtmlTable:
    """The table's texts; numbers are rounded, absent ones a dash."""
    return HtmlTable(table.title, [_block(table, columns) for columns in abreast(table.columns)], table.notes)


def _block(table: Table, columns: List[int]) -> Block:
    shown = [table.columns[index] for index in columns]
    groups = [
        Group(text, last - first + 1) for text, first, last in equal_neighbours([column.group for column in shown])
    ]
    has_groups = any(group.text for group in groups)
    heads = [
        Head(column.head, bool(column.group) or is_number_column(table, index)) for column, index in zip(shown, columns)
    ]
    keys = sum(not column.group for column in shown) if has_groups else 1
    return Block(groups if has_groups else [], heads, keys, _rows(table, columns))


def _rows(table: Table, columns: List[int]) -> List[Row]:
    rows = []
    for number, row in enumerate(table.rows):
        is_first = number > 0 and row[0] != table.rows[number - 1][0]
        rows.append(Row([rounded(row[index], '–') for index in columns], is_first))
    return rows
