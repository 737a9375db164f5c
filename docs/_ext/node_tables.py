"""Directives that make tables from the code: `node NAME`, `parameters CLASS [config/FILE]`, and `recorded-topics`.

Topics and services of nodes stand in docs/nodes.yaml, which live tests compare with running nodes.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any, Dict, Iterable, Iterator, List, Sequence, Type

from docutils import nodes
from parameter_tables import parameter_tables
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.errors import ExtensionError
from sphinx.ext.autodoc.mock import mock
from sphinx.util.docutils import SphinxDirective

from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.topics import LIVE_TOPICS

ROOT = Path(__file__).resolve().parents[2]
NODES: Dict[str, Dict[str, Any]] = load_yaml(ROOT / 'docs' / 'nodes.yaml')


class NodeDirective(SphinxDirective):
    """The interface of one node of docs/nodes.yaml."""

    required_arguments = 1

    def run(self) -> List[nodes.Node]:
        """Return summary, topics, services and parameters."""
        name = self.arguments[0]
        self.env.note_dependency(str(ROOT / 'docs' / 'nodes.yaml'))
        self.env.documented_nodes = {*getattr(self.env, 'documented_nodes', ()), name}  # type: ignore[attr-defined]
        return self.parse_text_to_nodes('\n'.join(self._lines(name, NODES[name])))

    def _lines(self, name: str, node: Dict[str, Any]) -> Iterator[str]:
        yield node['summary']
        if 'executable' in node:
            yield f'\nThe executable is `{node["executable"]}`.'
        for key, title in (('subscribes', 'Subscribes to'), ('publishes', 'Publishes'), ('services', 'Serves')):
            if node.get(key) == 'recorded':
                yield f'\n{title} every topic of [the bag](#topics-of-a-bag).'
            elif key in node:
                rows = [(f'`{topic}`', f'`{kind}`', text) for topic, (kind, text) in node[key].items()]
                yield from table((title, 'Type', 'Meaning'), rows)
        if 'reconfigures' in node:
            rows = [(f'`{namespace}`', text) for namespace, text in node['reconfigures'].items()]
            title = '[Changes while it runs](live_trials.md#navigation)'
            yield from table((title, 'Parameters'), rows)
        if 'params' in node:
            yield from parameters(self, node['params'], node.get('config', ''), '~')


class ParametersDirective(SphinxDirective):
    """The keys of a file, by the class that reads it."""

    required_arguments = 1
    optional_arguments = 1

    def run(self) -> List[nodes.Node]:
        """Return a table for the class and for each class nested in it."""
        return self.parse_text_to_nodes('\n'.join(parameters(self, self.arguments[0], *self.arguments[1:])))


class RecordedTopicsDirective(SphinxDirective):
    """What a trial's bag holds."""

    def run(self) -> List[nodes.Node]:
        """Return one row for each topic."""
        rows = [
            (
                f'`{topic.name}`',
                f'`{topic.message_type.replace("/msg/", "/")}`',
                ', '.join(f'`{node[1:]}`' for node in topic.nodes) or 'people (RViz)',
                '' if topic.is_bulk else 'yes',
            )
            for topic in LIVE_TOPICS
        ]
        return self.parse_text_to_nodes('\n'.join(table(('Topic', 'Type', 'Published by', 'In `minimal`'), rows)))


def parameters(directive: SphinxDirective, dotted: str, config: str = '', prefix: str = '') -> Iterator[str]:
    """Return the Markdown of a class's parameters."""
    values: Dict[str, Any] = {}
    if config:
        directive.env.note_dependency(str(ROOT / 'config' / config))
        values = load_yaml(ROOT / 'config' / config)
    for part in parameter_tables(_params_class(dotted, directive.config.autodoc_mock_imports), values):
        spaces = ' and '.join(f'`{prefix}{space}`' for space in part.namespaces if space)
        title = f'Below {spaces}' if spaces else f'Parameter `{prefix}`' if prefix else 'Key'
        rows = [(row.name, row.type_text, row.default, row.configured, row.meaning) for row in part.rows]
        heads = (title, 'Type', 'Default', f'In `{config}`', 'Meaning')
        if not any(row.configured for row in part.rows):
            heads, *rows = ((name, kind, default, meaning) for name, kind, default, _, meaning in (heads, *rows))
        yield from table(heads, rows)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Return a Markdown table."""
    yield ''
    for cells in (heads, ['---'] * len(heads), *rows):
        yield '| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |'
    yield ''


def _params_class(dotted: str, mocked: List[str]) -> Type[Params]:
    module, _, name = dotted.rpartition('.')
    with mock(mocked):
        found = getattr(importlib.import_module(module), name, None)
    if found is None:
        raise ExtensionError(f'{dotted}: there is no such class')
    return found


def check_complete(_: Sphinx, env: BuildEnvironment) -> None:
    """Raise where a node of docs/nodes.yaml is on no page."""
    missing = set(NODES) - set(getattr(env, 'documented_nodes', NODES))
    if missing:
        raise ExtensionError(f'docs/nodes.yaml: on no page: {", ".join(sorted(missing))}')


def setup(app: Sphinx) -> Dict[str, bool]:
    """Register the directives with Sphinx."""
    app.add_directive('node', NodeDirective)
    app.add_directive('parameters', ParametersDirective)
    app.add_directive('recorded-topics', RecordedTopicsDirective)
    app.connect('env-check-consistency', check_complete)
    return {'parallel_read_safe': False, 'parallel_write_safe': True}
