"""Figures within the page, so that it is one file."""

from __future__ import annotations

import base64
import urllib.parse
from pathlib import Path

# What may stand in a quoted attribute as it is; the SVG stays a text, which is smaller than base64.
UNQUOTED = " !'()*+,-./:;=?@[]^_`{|}~\n"


def data_uri(svg: Path, png: Path) -> str:
    """The smaller of the two forms of a figure, as the address of an image."""
    drawn = 'data:image/svg+xml,' + urllib.parse.quote(svg.read_text(encoding='utf-8'), safe=UNQUOTED)
    pixels = 'data:image/png;base64,' + base64.b64encode(png.read_bytes()).decode('ascii')
    return min(drawn, pixels, key=len)
