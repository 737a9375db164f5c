"""Numbers in text: ASCII digits only, where Python's float() and int() also accept 7_0 and digits of other scripts."""

from __future__ import annotations

import re

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
