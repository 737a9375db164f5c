"""The real encoders of a campaign: what their counts follow from, and whose numbers these are."""

from __future__ import annotations

from typing import Any, Dict, List, Optional

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.report.html_table import HtmlTable, html_table
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table

_COLUMNS = [
    Column('encoder', 'encoder'),
    Column('name', 'as one buys it'),
    Column('price', 'price'),
    Column('resolution', 'resolution'),
    Column('counts_per_metre', 'counts per metre'),
    Column('source', 'source'),
]


def encoder_section(dataset: Dataset) -> Optional[HtmlTable]:
    """Return the table of a campaign's real encoders; None where it has none, and of bags."""
    encoders = (dataset.manifest or {}).get('encoders')
    if not isinstance(encoders, list):
        return None
    try:
        return html_table(Table('', 'Real encoders', _COLUMNS, [_row(encoder) for encoder in encoders], []))
    except (KeyError, TypeError, ValueError, AttributeError):  # a manifest that somebody has edited
        return None


def _row(encoder: Dict[str, Any]) -> List[Entry]:
    per_metre = Number(float(encoder['counts_per_metre']), 1)
    texts = [str(encoder[key]) for key in ('name', 'price', 'resolution')]
    return [ppr_text(str(encoder['label'])), *texts, per_metre, '; '.join(map(str, encoder['source']))]
