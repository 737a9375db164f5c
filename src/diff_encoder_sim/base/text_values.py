"""Values in text: plain numbers, cells of CSV files, attributes of SDF and URDF, XML-RPC."""

from __future__ import annotations

import re
from typing import Any, Mapping, Tuple

_FLOAT = re.compile(r'[-+]?(([0-9]+\.?[0-9]*|\.[0-9]+)(e[-+]?[0-9]+)?|inf|infinity|nan)', re.IGNORECASE | re.ASCII)
_INT = re.compile('[-+]?[0-9]{1,30}', re.ASCII)


def plain_float(text: str) -> float:
    """Return the number, which may be infinite or NaN, of a text with or without blanks around it.

    Raises:
        ValueError: it is none.
    """
    if not _FLOAT.fullmatch(text.strip()):
        raise ValueError(f'{text!r} is no number')
    return float(text)


def plain_int(text: str) -> int:
    """Return the whole number of a text.

    Raises:
        ValueError: it is none, or has more than 30 digits.
    """
    if not _INT.fullmatch(text):
        raise ValueError(f'{text!r} is no whole number')
    return int(text)


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


Vector = Tuple[float, float, float]


LARGEST_INT = 2**31 - 1


def for_xml_rpc(value: Any) -> Any:
    """Return a value with its large whole numbers as text, those in mappings and lists, too."""
    if isinstance(value, Mapping):
        return {key: for_xml_rpc(each) for key, each in value.items()}
    if isinstance(value, list):
        return [for_xml_rpc(each) for each in value]
    is_large = isinstance(value, int) and abs(value) > LARGEST_INT
    return str(value) if is_large else value


def from_xml_rpc(value: Any) -> Any:
    """Return what `for_xml_rpc` was given."""
    if isinstance(value, Mapping):
        return {key: from_xml_rpc(each) for key, each in value.items()}
    if isinstance(value, list):
        return [from_xml_rpc(each) for each in value]
    is_large = isinstance(value, str) and re.fullmatch('-?[1-9][0-9]{9,18}', value) is not None
    return int(value) if is_large else value
