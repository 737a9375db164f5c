"""Numbers for readers and files."""

from __future__ import annotations


def rounded(number: float, digits: int = 2) -> float:
    """Round to significant digits."""
    return float(f'{number:.{digits}g}')


def turns_text(turns: float) -> str:
    """Return full turns with their unit."""
    return f'{turns:g} turn{"" if turns == 1.0 else "s"}'
