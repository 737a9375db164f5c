"""Texts in cells of CSV files: a spreadsheet executes those that begin as a formula does."""

from __future__ import annotations

import re

_FORMULA = re.compile("'*[=+\\-@\t\r\n]")
_NUMBER = r'[-+]?(?:inf|nan|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)'
# A number, or one with its interval and mark: -0.033 (-0.039 to -0.025) ≠
_NUMBERS = re.compile(rf'{_NUMBER}(?:(?: to | \(){_NUMBER}\)?)*(?: ≠)?')


def text_cell(text: str) -> str:
    """Return a text with an apostrophe in front if it begins as a formula; a number and its interval are kept."""
    return f"'{text}" if _FORMULA.match(text) and not _NUMBERS.fullmatch(text) else text


def text_of_cell(cell: str) -> str:
    """Return the text that `text_cell` got."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
