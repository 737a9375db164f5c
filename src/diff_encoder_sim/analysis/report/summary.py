"""The question that the report answers first: with which encoder does the robot end at its goal?"""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.dataset import IDEAL, Cell, Dataset, Varied
from diff_encoder_sim.analysis.table_keys import ppr_head
from diff_encoder_sim.analysis.within_tolerance import WORDS_OF_SOURCE, Share, fraction_within
from diff_encoder_sim.trials.pose_source import PoseSource


class Line(NamedTuple):
    """A row of the answer: a test by one source."""

    test: str
    varied: Varied
    source: PoseSource
    shares: Dict[str, Optional[Share]]  # by encoder, ascending; None without a final pose


def answer(dataset: Dataset) -> List[Line]:
    """By test and set of parameters, a row for each of `WORDS_OF_SOURCE`."""
    cells, labels = dataset.cells(), dataset.encoders()
    return [
        Line(
            test,
            varied,
            source,
            {
                label: fraction_within(cells[Cell(test, label, varied)], source)
                for label in labels
                if Cell(test, label, varied) in cells
            },
        )
        for test, varied in dict.fromkeys((cell.test, cell.varied) for cell in cells)
        for source in WORDS_OF_SOURCE
    ]


def encoder_names(labels: Sequence[str]) -> str:
    """Of one or more encoders, the unit once."""
    if IDEAL in labels:
        return listed([ppr_head(label) for label in labels])
    return ppr_head(listed(labels))


def listed(texts: Sequence[str]) -> str:
    """As a sentence has it: a, b and c."""
    return ' and '.join([', '.join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)
