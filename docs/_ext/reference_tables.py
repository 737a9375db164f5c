"""Directives for what stands elsewhere in the checkout: `launch-arguments`, `command-help` and `packages`."""

from __future__ import annotations

import ast
import contextlib
import importlib
import io
import os
from pathlib import Path
from typing import Dict, List, Mapping
from unittest import mock
from xml.etree import ElementTree

from docutils import nodes
from node_tables import table
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

import diff_encoder_sim

ROOT = Path(__file__).resolve().parents[2]
LAYERS = ROOT / 'test' / 'unit' / 'test_layers.py'
HELP_WIDTH = '88'


class LaunchArgumentsDirective(SphinxDirective):
    """The arguments of a launch file, by its own `doc` attributes."""

    required_arguments = 1

    def run(self) -> List[nodes.Node]:
        """Return one row for each argument."""
        file = ROOT / 'launch' / self.arguments[0]
        self.env.note_dependency(str(file))
        arguments = [argument.attrib for argument in ElementTree.parse(file).getroot().findall('arg')]
        missing = [argument['name'] for argument in arguments if 'doc' not in argument]
        if missing:
            raise ExtensionError(f'{file}: no doc: {", ".join(missing)}')
        rows = [(f'`{argument["name"]}`', _default(argument), argument['doc']) for argument in arguments]
        return self.parse_text_to_nodes('\n'.join(table(('Argument', 'Default', 'Meaning'), rows)))


class CommandHelpDirective(SphinxDirective):
    """What a command prints for --help."""

    required_arguments = 1

    def run(self) -> List[nodes.Node]:
        """Return the text as it is."""
        module = importlib.import_module(f'diff_encoder_sim.cli.{self.arguments[0]}')
        output = io.StringIO()
        width = mock.patch.dict(os.environ, COLUMNS=HELP_WIDTH)
        with width, contextlib.redirect_stdout(output), contextlib.suppress(SystemExit):
            module.main(['--help'])
        return [nodes.literal_block(output.getvalue(), output.getvalue(), language='text')]


class PackagesDirective(SphinxDirective):
    """The packages of the core, from bottom to top, and which of them each may import."""

    def run(self) -> List[nodes.Node]:
        """Return one row for each package, as test/unit/test_layers.py holds them."""
        self.env.note_dependency(str(LAYERS))
        rows = [(f'[{name}](api/{name})', _subject(name), imported) for name, imported in _may_import().items()]
        return self.parse_text_to_nodes('\n'.join(table(('Package', 'Contents', 'Imports'), rows)))


def _default(argument: Mapping[str, str]) -> str:
    default = argument.get('default')
    if default is None:
        return 'required'
    return f'`{default.replace("$(find diff_encoder_sim)/", "")}`' if default else ''


def _may_import() -> Dict[str, str]:
    for node in ast.parse(LAYERS.read_text(encoding='utf-8')).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == 'MAY_IMPORT':
            return {name: ', '.join(imported.split()) for name, imported in ast.literal_eval(node.value).items()}
    raise ExtensionError(f'{LAYERS}: no MAY_IMPORT')


def _subject(name: str) -> str:
    """Return the first line of a package's docstring."""
    path = Path(diff_encoder_sim.__path__[0]) / name / '__init__.py'
    docstring = ast.get_docstring(ast.parse(path.read_text(encoding='utf-8'))) or ''
    return docstring.splitlines()[0]


def setup(app: Sphinx) -> Dict[str, bool]:
    """Register the directives with Sphinx."""
    app.add_directive('launch-arguments', LaunchArgumentsDirective)
    app.add_directive('command-help', CommandHelpDirective)
    app.add_directive('packages', PackagesDirective)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
