"""HTML templates of pages, next to the modules that fill them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from diff_encoder_sim.base.deferred import deferred

if TYPE_CHECKING:
    import jinja2
else:
    jinja2 = deferred('jinja2')

STYLE = Path(__file__).parent / 'report'  # folder of the shared parts of all pages


def load_template(name: str, *folders: Path) -> jinja2.Template:
    """Load a template that escapes data, rejects undefined names and may include files of these folders."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([str(folder) for folder in folders]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)
