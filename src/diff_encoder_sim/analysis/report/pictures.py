"""Embeds figures in the page, so that it is one file."""

from __future__ import annotations

import base64
import io
import urllib.parse
from pathlib import Path

from PIL import Image

# Need no escape in a quoted attribute; SVG as text is smaller than base64.
UNQUOTED = " !'()*+,-./:;=?@[]^_`{|}~\n"


# Of a figure of few hues, and of their blends at edges; moved to where most pixels are, so often.
COLOURS, MOVES = 64, 2


def data_uri(svg: Path, png: Path) -> str:
    """Encode the smaller of the two formats of a figure as a data URI; pixels with few colours."""
    drawn = 'data:image/svg+xml,' + urllib.parse.quote(svg.read_text(encoding='utf-8'), safe=UNQUOTED)
    pixels = 'data:image/png;base64,' + base64.b64encode(_few_colours(png)).decode('ascii')
    return min(drawn, pixels, key=len)


def _few_colours(png: Path) -> bytes:
    file = io.BytesIO()
    with Image.open(png) as image:
        image.convert('RGB').quantize(COLOURS, kmeans=MOVES).save(file, 'PNG', optimize=True)
    return file.getvalue()
