"""Figures within the page."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.analysis.report.pictures import COLOURS, data_uri

DRAWN = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>'


@pytest.fixture
def files(tmp_path):
    """A figure of so many colours that they are not free."""
    svg, png = tmp_path / 'a.svg', tmp_path / 'a.png'
    svg.write_text(DRAWN)
    Image.fromarray(np.random.default_rng(1).integers(0, 256, (90, 90, 3), np.uint8)).save(png)
    return svg, png


def test_the_smaller_form_of_a_figure_is_taken(files):
    svg, png = files
    assert data_uri(svg, png).startswith('data:image/svg+xml,%3Csvg xmlns')
    svg.write_text(1000 * DRAWN)
    assert data_uri(svg, png).startswith('data:image/png;base64,iVBORw')


def test_pixels_have_few_colours_and_stay_as_many(files):
    svg, png = files
    svg.write_text(1000 * DRAWN)
    pixels = base64.b64decode(data_uri(svg, png).partition(',')[2])
    assert len(pixels) < 0.5 * png.stat().st_size
    with Image.open(io.BytesIO(pixels)) as image:
        assert image.size == (90, 90) and len(image.getcolors()) <= COLOURS
