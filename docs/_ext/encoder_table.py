"""Directive `encoders`: the encoders of config/encoders, by their files."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, Iterator, List, Tuple

from docutils import nodes
from node_tables import table
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from diff_encoder_sim.base.params import flat
from diff_encoder_sim.wheels.catalogue import OF_ROBOT, ChosenEncoder, encoder_names, load_encoder
from diff_encoder_sim.wheels.encoder_params import EncoderModel

CONFIG = Path(__file__).resolve().parents[2] / 'config'
COLUMNS = ('Name', 'Manufacturer', 'Part, link', 'Type', 'Price class', 'Shaft', 'Counts')
OF_SHAPE = ('sensor', 'lines', 'decoding', 'pole_pairs', 'bits', 'side', 'gear_ratio', 'direction')


class EncodersDirective(SphinxDirective):
    """The encoders that come with the package."""

    def run(self) -> List[nodes.Node]:
        """Return tables of the encoders and of their known errors, each with the coarsest encoder first."""
        for name in encoder_names(CONFIG):
            self.env.note_dependency(str(CONFIG / 'encoders' / f'{name}.yaml'))
        encoders = [load_encoder(name, CONFIG, CONFIG) for name in encoder_names(CONFIG)]
        encoders.sort(key=lambda encoder: encoder.ppr.left)
        lines: List[str] = []
        for is_of_robot, title in enumerate(('Sold separately or with a motor:', 'Of robots:')):
            of_kind = (each for each in encoders if each.real and (each.real.price == OF_ROBOT) == is_of_robot)
            lines += [title, *table(COLUMNS, map(_row, of_kind))]
        known = [(each.name, list(_errors(each.real.encoder))) for each in encoders if each.real]
        errors = {name: '; '.join(f'`{key}` {value:g}' for key, value in pairs) for name, pairs in known if pairs}
        rows = [(f'`{name}`', text) for name, text in errors.items()]
        lines += ['Known errors; nothing is published about the others:', *table(('Name', 'Known of its errors'), rows)]
        return self.parse_text_to_nodes('\n'.join(lines))


def _row(encoder: ChosenEncoder) -> Tuple[str, ...]:
    assert encoder.real is not None
    counts, file = f'{encoder.ppr.left:.2f}'.rstrip('0').rstrip('.'), encoder.real
    part = f'[{file.part}]({file.link})' if file.link else file.part
    kind = f'{file.type}, {_resolution(file.encoder)}'
    return f'`{encoder.name}`', file.manufacturer, part, kind, file.price, file.shaft, counts


def _errors(model: EncoderModel) -> Iterator[Tuple[str, float]]:
    """Yield the keys of the file that do not set the counts."""
    given = model.model_dump(exclude_unset=True)
    return ((key, value) for key, value in flat(given) if key not in OF_SHAPE)


def _resolution(model: EncoderModel) -> str:
    shape = {'hall': f'{model.pole_pairs} pole pairs', 'absolute': f'{model.bits} bits'}
    text = shape.get(model.sensor, f'{model.lines} line{"s" if model.lines != 1 else ""} {model.decoding}')
    return f'{text}, gear {model.gear_ratio:.6g}' if model.side == 'motor' else text


def setup(app: Sphinx) -> Dict[str, bool]:
    """Register the directive with Sphinx."""
    app.add_directive('encoders', EncodersDirective)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
