"""Encoder labels as trials.csv and the tables have them: the PPR (`ppr_label`), or `ideal`."""

from __future__ import annotations

import math
from typing import List, Optional, Sequence, Tuple

IDEAL = 'ideal'  # odometry from the simulator, without an encoder


def ppr_value(label: str) -> Optional[float]:
    """Return the pulses per revolution of both wheels; None where they differ or there is no encoder."""
    try:
        return float(label)
    except ValueError:
        return None


def ppr_values(labels: Sequence[str]) -> List[float]:
    """Return the distinct pulses per revolution of the labels that have one, ascending."""
    return sorted({value for value in map(ppr_value, labels) if value is not None})


def ppr_order(label: str) -> Tuple[float, str]:
    """Return a sort key: PPR ascending, then wheels that differ, then ideal odometry."""
    value = ppr_value(label)
    return (math.inf if value is None else value), label


def ppr_text(label: str) -> str:
    """Return an encoder as tables show it: `90 PPR`."""
    return 'ideal odometry' if label == IDEAL else f'{label} PPR'


def encoders_text(labels: Sequence[str]) -> str:
    """Join one or more encoders, the unit once: `40, 90 and 1024 PPR`."""
    if IDEAL in labels:
        return enumeration([ppr_text(label) for label in labels])
    return ppr_text(enumeration(labels))


def enumeration(texts: Sequence[str]) -> str:
    """Join texts as in a sentence: `a, b and c`."""
    return ' and '.join([', '.join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)
