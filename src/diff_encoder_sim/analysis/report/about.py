"""Offline pages, and the block that all share: origin and links of the page."""

from __future__ import annotations

import os
import urllib.parse
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, NamedTuple, Optional, Sequence

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.command_line import command_line
from diff_encoder_sim.base.package_files import package_folder, package_version
from diff_encoder_sim.drives.test_definition import TestDefinition


class Link(NamedTuple):
    """Link of a page to a file of this machine."""

    text: str
    path: Optional[Path] = None  # None: shown as text only
    command: str = ''  # which writes the file later; '' if it exists


class PageAbout(NamedTuple):
    """Content of the block; date and version are those of the writing program."""

    name: str  # of the command that writes the page; its arguments are shown if it was called on a command line
    wheels: str  # see `wheels_text`
    links: Sequence[Link] = ()  # related pages, robot file, guides
    tests: Sequence[TestDefinition] = ()  # of the page, which are explained once


def save_page(path: Path, template: Path, about: PageAbout, **content: Any) -> None:
    """Render a template, which extends layout.html, and write it atomically; OSError on failure.

    Links are relative to the page: they stay valid if the page and its files are moved together.
    """
    from diff_encoder_sim.analysis.charts.chart_page import load_template  # noqa: PLC0415 - Altair takes a second

    links = [{**link._asdict(), 'href': link.path and href(link.path, path.parent)} for link in about.links]
    date, command = f'{datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC', command_line(about.name)
    origin = {'about': about, 'links': links, 'date': date, 'command': command, 'version': package_version()}
    write_file(path, load_template(template).render(**origin, **content).encode('utf-8'))


def href(target: Path, folder: Path) -> str:
    """Return the address of a file, relative to a page in `folder`."""
    relative = os.path.relpath(str(target.resolve()), str(folder.resolve()))
    return urllib.parse.quote(relative, safe='/')


def guide(name: str) -> Link:
    """Return a link to a guide, such as `which_encoder`; `index` is the documentation.

    It leads to the built site of a checkout (.ws/docs), else to the Markdown file. An installation by pip has neither:
    there the guide is only named.
    """
    root, text = package_folder(), 'Documentation' if name == 'index' else name.replace('_', ' ').capitalize()
    pages = root / '.ws' / 'docs' / f'{name}.html', root / 'docs' / f'{name}.md'
    path = next((page for page in pages if page.is_file()), None)
    return Link(text if path else f'{text} (docs/{name}.md)', path)


def robot_file(where: str) -> Sequence[Link]:
    """Return a link to a robot file, if there is one."""
    path = Path(where)
    return [Link(f'Robot file {path.name}', path)] if path.is_file() else []


def wheels_text(left_diameter_m: float, right_diameter_m: float, separation_m: float, quality: str = '') -> str:
    """Return the geometry of the wheels, and their quality, in one line."""
    both = f'{left_diameter_m:g} m'
    both += '' if left_diameter_m == right_diameter_m else f' (left), {right_diameter_m:g} m (right)'
    return '; '.join(filter(None, [f'diameter {both}, separation {separation_m:g} m', quality]))
