"""Figures within the page."""

import pytest

from diff_encoder_sim.analysis.figures.style import Figure
from diff_encoder_sim.analysis.report.pictures import data_uri


@pytest.fixture
def figure(tmp_path):
    svg, png = tmp_path / 'a.svg', tmp_path / 'a.png'
    svg.write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>')
    png.write_bytes(b'\x89PNG' + bytes(200))
    return Figure('a', 'A caption <of> it.', png, svg)


def test_the_smaller_form_of_a_figure_is_taken(figure):
    assert data_uri(figure.svg, figure.png).startswith('data:image/svg+xml,%3Csvg xmlns')
    figure.png.write_bytes(b'\x89PNG')
    assert data_uri(figure.svg, figure.png) == 'data:image/png;base64,iVBORw=='
