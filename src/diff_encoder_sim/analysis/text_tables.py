"""Tables of strings, for the terminal and for pages (`report/charts_and_tables.html`)."""

from __future__ import annotations

import textwrap
from typing import List, NamedTuple

from tabulate import tabulate

NOTE_COLUMNS = 100  # of notes in the terminal


class TextTable(NamedTuple):
    """Table of strings."""

    title: str
    heads: List[str]
    rows: List[List[str]]
    note: str = ''
    texts: int = 2  # columns on the left that are aligned left

    def text(self) -> str:
        """Return the table for the terminal."""
        aligned = [*['left'] * self.texts, *['right'] * (len(self.heads) - self.texts)]
        text = tabulate(self.rows, self.heads, disable_numparse=True, colalign=aligned)
        return '\n'.join([self.title, text, *(textwrap.fill(line, NOTE_COLUMNS) for line in self.note.splitlines())])
