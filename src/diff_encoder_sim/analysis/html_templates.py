"""HTML templates of pages, next to the modules that fill them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from diff_encoder_sim.base.deferred import deferred

jinja2 = deferred('jinja2')
STYLE = Path(__file__).parent / 'report'  # folder of the shared parts of all pages


def load_template(name: str, *folders: Path) -> Any:
    """Load a template that escapes data, rejects undefined names and may include files of these folders."""
    loader = jinja2.FileSystemLoader(list(map(str, folders)))
    checks = {'autoescape': True, 'undefined': jinja2.StrictUndefined}
    environment = jinja2.Environment(loader=loader, trim_blocks=True, lstrip_blocks=True, **checks)
    return environment.get_template(name)
