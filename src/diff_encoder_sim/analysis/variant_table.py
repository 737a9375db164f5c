"""The table of a campaign's variants: what each of them costs with each encoder."""

from __future__ import annotations

import math
from typing import List, Optional

from diff_encoder_sim.analysis.dataset import CellKey, Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.paired_statistics import PairedResult
from diff_encoder_sim.analysis.table import Column, Entry, Label, Number, Table
from diff_encoder_sim.analysis.table_keys import key_columns, key_entries, varied_keys
from diff_encoder_sim.analysis.variant_errors import (
    KINDS,
    VARIANTS,
    ErrorKind,
    VariantError,
    first_variant,
    variant_errors,
)

_HEADS = ('median', 'quartiles', 'ratio', '95 %', 'failed')


def variant_table(dataset: Dataset) -> Optional[Table]:
    """Build rows of test, variant and kind of error, columns by encoder; None where there are no variants."""
    errors = {kind: variant_errors(dataset, kind) for kind in KINDS}
    if not any(errors.values()):
        return None
    keys, labels = varied_keys(dataset), dataset.encoders()
    rows: List[List[Entry]] = [
        [
            *key_entries(test, varied, keys),
            Label(kind.name, kind.head),
            *(entry for label in labels for entry in _entries(kind, of_kind.get(CellKey(test, label, varied)))),
        ]
        for test, varied in dataset.setups()
        for kind, of_kind in errors.items()
    ]
    groups = [
        Column(f'ppr{label}_{head}'.replace(' ', '_'), head, ppr_text(label)) for label in labels for head in _HEADS
    ]
    columns = [*key_columns(keys), Column('error', 'error'), *groups]
    title = "Variants: the odometry's own final error, /odom minus /world_pose"
    return Table(VARIANTS, title, columns, rows, _notes(dataset))


def _notes(dataset: Dataset) -> List[str]:
    counted = 'All trials that ended with a pose count, where they ended; failed: how many did not succeed.'
    first = f'Ratio: of the errors to those of equal trials of the variant {first_variant(dataset.cells())!r}'
    return [
        f'Distance in position, and angle of heading: median, and difference of the quartiles. {counted}',
        f"{first}, by the signed ranks of its logarithm, with the comparison's own 95 % interval (from six trials on).",
    ]


def _entries(kind: ErrorKind, error: Optional[VariantError]) -> List[Entry]:
    """Return an entry for each of `_HEADS`."""
    if error is None:
        return [*[Number(None, 0)] * 3, '', Number(None, 0)]
    spread = Number(error.high - error.low, kind.decimals)
    return [Number(error.median, kind.decimals), spread, *_ratio_entries(error.ratio), Number(error.failed, 0)]


def _ratio_entries(ratio: Optional[PairedResult]) -> List[Entry]:
    if ratio is None:
        return [Number(None, 2), '']
    low, high = ratio.interval
    return [Number(ratio.estimate, 2), f'{low:.3g} to {high:.3g}' if math.isfinite(high) else '']
