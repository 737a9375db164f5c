"""The figures of an analysis: PNG and SVG, the same bytes for the same data."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, List, NamedTuple, Optional

import matplotlib
from matplotlib.figure import Figure as Drawing

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.encoder_labels import is_real
from diff_encoder_sim.analysis.figures.distributions import draw_distributions
from diff_encoder_sim.analysis.figures.spread import draw_spread
from diff_encoder_sim.analysis.figures.style import MOST_POINTS, STYLE, Figure, save
from diff_encoder_sim.analysis.figures.trajectory_plot import MOST_TRIALS, draw_trajectories
from diff_encoder_sim.analysis.figures.variant_plot import draw_variants
from diff_encoder_sim.analysis.figures.variants import Variant, variants_of
from diff_encoder_sim.analysis.figures.xy_errors import draw_xy_errors
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.analysis.variant_errors import VARIANTS
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE

VARIANTS_CAPTION = (
    "The odometry's own final error, /odom minus /world_pose, in each variant: medians and quartiles, and the median "
    'of the first variant as dotted lines. The other figures are of that variant.'
)


class Drawn(NamedTuple):
    """A figure before it is written."""

    name: str
    caption: str
    drawing: Optional[Drawing]  # None where there is nothing to show


def write_figures(dataset: Dataset, folder: Path) -> List[Figure]:
    """Write all figures that have data into `folder`, which is created.

    Where parameters are varied besides the encoder, each of their combinations has figures of its own; of named
    variants the first alone, and one figure has all.

    Raises:
        OSError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    figures = []
    with matplotlib.rc_context(STYLE):
        for variant in variants_of(dataset):
            note = _note(variant)
            for drawn in _draw(dataset, variant):
                if drawn.drawing is not None:
                    figures.append(save(drawn.drawing, drawn.name + variant.suffix, f'{drawn.caption}{note}.', folder))
        of_variants = draw_variants(dataset)
        if of_variants is not None:
            figures.insert(0, save(of_variants, VARIANTS, VARIANTS_CAPTION, folder))
    return figures


def _note(variant: Variant) -> str:
    """Return what a caption says of the variant in brackets, and of points that are left out; '' for nothing."""
    points = f'points: the first {MOST_POINTS} trials of each cell'
    has_more = any(len(trials) > MOST_POINTS for trials in variant.cells.values())
    texts = [text for text in (variant.description, points if has_more else '') if text]
    return f' ({"; ".join(texts)})' if texts else ''


def _draw(dataset: Dataset, variant: Variant) -> Iterator[Drawn]:
    """Draw one figure after the other, so that only one is in memory."""
    circle, band = f'{X.tolerance:g} m', f'{X.tolerance:g} m and {YAW.tolerance:g} degrees'
    for source, topic in TOPIC_OF_SOURCE.items():
        caption = f'Final {topic} minus the goal; the circle has a radius of {circle}'
        yield Drawn(f'fig4_xy_errors_{source.value}', caption, draw_xy_errors(variant, source))
    for source, topic in TOPIC_OF_SOURCE.items():
        caption = f'Final {topic} minus the goal by encoder; shaded: within {band}'
        yield Drawn(f'fig5_distributions_{source.value}', caption, draw_distributions(variant, source))
    for test in variant.tests():
        if test in dataset.requested:
            caption = f'{test}: true paths and /odom, of at most {MOST_TRIALS} trials of each encoder'
            yield Drawn(f'trajectories_{test}', caption, draw_trajectories(variant, test, dataset.requested[test]))
    caption = (
        "Standard deviation against the encoder's resolution, with 95 % intervals; the closed form is for stops that "
        'differ by more than a pulse'
    )
    caption += '; hollow: real encoders' if any(map(is_real, variant.labels)) else ''
    yield Drawn('spread_vs_ppr', caption, draw_spread(variant, dataset.robot, dataset.requested))
