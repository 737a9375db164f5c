"""Encoder labels of trials.csv and the tables (`encoders.pulses.encoder_label`), or `ideal`.

`90`: ideal encoder with 90 counts per wheel turn; `40-90`: 40 left, 90 right; `8192 amt102`: real encoder with 8192.
"""

from __future__ import annotations

import math
from typing import List, Optional, Sequence, Tuple

IDEAL = 'ideal'  # odometry from the simulator, without an encoder


def ppr_value(label: str) -> Optional[float]:
    """Return the counts per wheel revolution; None if the wheels differ or there is no encoder."""
    try:
        return float(label.partition(' ')[0])
    except ValueError:
        return None


def ppr_values(labels: Sequence[str]) -> List[float]:
    """Return the distinct counts per wheel revolution of the labels, ascending."""
    return sorted({value for value in map(ppr_value, labels) if value is not None})


def is_real(label: str) -> bool:
    """Return whether the label belongs to a named real encoder."""
    return ' ' in label


def ppr_order(label: str) -> Tuple[float, str]:
    """Return a sort key: ascending counts, ideal encoders first; then different wheels, then ideal odometry."""
    value = ppr_value(label)
    return (math.inf if value is None else value), label


def ppr_text(label: str, unit: str = 'counts') -> str:
    """Return the name of an encoder in tables: `90 counts`, or `amt102 (8192 counts)`; the paper's unit is PPR."""
    if is_real(label):
        counts, _, name = label.partition(' ')
        return f'{name} ({counts} counts)'
    return 'ideal odometry' if label == IDEAL else f'{label} {unit}'


def encoders_text(labels: Sequence[str]) -> str:
    """Join the names of encoders with one unit: `40, 90 and 1024 counts`."""
    if IDEAL in labels or any(map(is_real, labels)):
        return enumeration([ppr_text(label) for label in labels])
    return f'{enumeration(labels)} counts'


def enumeration(texts: Sequence[str]) -> str:
    """Join texts as in a sentence: `a, b and c`."""
    return ' and '.join([', '.join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)
