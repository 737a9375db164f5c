"""Writes the pages of the API reference, docs/api/: one for each package, with the docstrings of all its modules."""

from __future__ import annotations

import pkgutil
from pathlib import Path
from typing import Dict, List

from sphinx.application import Sphinx

import diff_encoder_sim

GENERATED = '.. Made by docs/_ext/api_pages.py.\n\n'


def write_pages(app: Sphinx) -> None:
    """Write each page that changed, and remove those of packages that are gone."""
    folder = Path(app.srcdir) / 'api'
    folder.mkdir(exist_ok=True)
    pages = {f'{name}.rst': GENERATED + _page(name, modules) for name, modules in _packages().items()}
    for old in folder.glob('*.rst'):
        if old.name not in pages:
            old.unlink()
    for name, text in pages.items():
        if not (folder / name).exists() or (folder / name).read_text(encoding='utf-8') != text:
            (folder / name).write_text(text, encoding='utf-8')


def _packages() -> Dict[str, List[str]]:
    """Return the modules of each package, by the package's name below diff_encoder_sim."""
    packages: Dict[str, List[str]] = {}
    prefix = diff_encoder_sim.__name__ + '.'
    for module in pkgutil.walk_packages(diff_encoder_sim.__path__, prefix, onerror=lambda _: None):
        name = module.name[len(prefix) :]
        if name.split('.')[0] == 'msg':
            continue
        if module.ispkg:
            packages.setdefault(name, [])
        else:
            packages.setdefault(name.rpartition('.')[0], []).append(name)
    return packages


def _page(package: str, modules: List[str]) -> str:
    parts = [_heading(package, '='), f'.. automodule:: diff_encoder_sim.{package}\n\n']
    for module in modules:
        parts += [
            _heading(module.rpartition('.')[2], '-'),
            f'.. automodule:: diff_encoder_sim.{module}\n   :members:\n\n',
        ]
    return ''.join(parts)


def _heading(text: str, line: str) -> str:
    return f'{text}\n{line * len(text)}\n\n'


def setup(app: Sphinx) -> Dict[str, bool]:
    """Register with Sphinx."""
    app.connect('builder-inited', write_pages)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
