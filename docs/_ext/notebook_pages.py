"""Makes pages of the notebooks in docs/notebooks/: their text, code, and what is shown below it."""

from __future__ import annotations

import json
from typing import Any, Dict, Iterator

from docutils import nodes
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx


class NotebookParser(MystParser):
    """Reads a notebook as the page in Markdown that it stands for."""

    supported = ('notebook',)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Add the page to the document."""
        cells = json.loads(inputstring)['cells']
        super().parse('\n\n'.join(text for cell in cells for text in _markdown(cell)), document)


def _markdown(cell: Dict[str, Any]) -> Iterator[str]:
    source = ''.join(cell['source'])
    if cell['cell_type'] == 'markdown':
        yield source
        return
    yield f'```python\n{source}\n```'
    for output in cell['outputs']:
        if output['output_type'] == 'stream':
            yield f'```text\n{"".join(output["text"])}```'
        else:
            picture = output['data']['image/png'].strip()
            yield f'```{{raw}} html\n<img alt="figure of the code above" src="data:image/png;base64,{picture}">\n```'


def setup(app: Sphinx) -> Dict[str, bool]:
    """Register with Sphinx."""
    app.add_source_suffix('.ipynb', 'notebook')
    app.add_source_parser(NotebookParser)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
