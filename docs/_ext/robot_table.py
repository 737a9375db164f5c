"""Directive `robots`: the robots of config/robots, by their files."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Dict, List, Tuple

from docutils import nodes
from node_tables import table
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.robot_file import load_robot_file

ROOT = Path(__file__).resolve().parents[2]
COLUMNS = ('Name', 'Robot', 'Mass [kg]', 'Wheels: diameter, separation [m]', 'PPR', 'Counter', 'Reports [Hz]')
# The first sentence or clause of the xacro's first comment.
TITLE = re.compile(r'<!--\s*(.*?)[.,;:]?\s*\n')
USUAL_RATE_HZ = 20.0


class RobotsDirective(SphinxDirective):
    """The robots that come with the package."""

    def run(self) -> List[nodes.Node]:
        """Return one row for each robot."""
        files = sorted((ROOT / 'config' / 'robots').glob('*.yaml'))
        for file in files:
            self.env.note_dependency(str(file))
        return self.parse_text_to_nodes('\n'.join(table(COLUMNS, [_row(file.stem) for file in files])))


def _row(name: str) -> Tuple[str, ...]:
    file = load_robot_file(name, ROOT, ROOT, {})
    robot = describe(file.source)
    states = file.overrides.get('config.counter_modulus', 0)
    rate_hz = file.overrides.get('config.rate', USUAL_RATE_HZ)
    wheels = f'{robot.wheel_diameter_m:g}, {robot.wheel_separation_m:g}'
    return (
        *(f'`{name}`', _title(file.source.file), f'{robot.mass.mass_kg:.3g}', wheels),
        *(f'{file.ppr:.2f}'.rstrip('0').rstrip('.'), _counter(states), f'{rate_hz:.3g}'),
    )


def _title(urdf: Path) -> str:
    match = TITLE.search(urdf.read_text(encoding='utf-8'))
    if match is None:
        raise ExtensionError(f'{urdf}: no comment that says which robot it is')
    return match.group(1)


def _counter(states: int) -> str:
    bits = states.bit_length() - 1
    return 'does not wrap' if states == 0 else f'{bits} bits' if states == 2**bits else f'{states} states'


def setup(app: Sphinx) -> Dict[str, bool]:
    """Register the directive with Sphinx."""
    app.add_directive('robots', RobotsDirective)
    return {'parallel_read_safe': True, 'parallel_write_safe': True}
