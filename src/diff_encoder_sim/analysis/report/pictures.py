"""Embeds figures in the page, so that it is one file."""

from __future__ import annotations

import base64
import urllib.parse
from pathlib import Path

# Need no escape in a quoted attribute; SVG as text is smaller than base64.
UNQUOTED = " !'()*+,-./:;=?@[]^_`{|}~\n"


def data_uri(svg: Path, png: Path) -> str:
    """Encode the smaller of the two formats of a figure as a data URI."""
    drawn = 'data:image/svg+xml,' + urllib.parse.quote(svg.read_text(encoding='utf-8'), safe=UNQUOTED)
    pixels = 'data:image/png;base64,' + base64.b64encode(png.read_bytes()).decode('ascii')
    return min(drawn, pixels, key=len)
