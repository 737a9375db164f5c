"""The command that draws a map from a world file."""

import pytest

from diff_encoder_sim.cli.rasterise_world import main as rasterise_world
from diff_encoder_sim.mapping.map_files import load_map
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world
from places import WORLDS


def test_the_tool_writes_a_map_that_is_read_back(tmp_path, capsys):
    world_file = str(WORLDS / 'hallway.world')
    rasterise_world([world_file, '--free', '-10', '0', '--resolution', '0.1', '--out', str(tmp_path / 'hall')])
    assert capsys.readouterr().out.strip() == str(tmp_path / 'hall.yaml')
    grid, expected = load_map(tmp_path / 'hall.yaml'), rasterise(load_world(world_file), 1.12, 0.1, -10.0, 0.0)
    assert (grid.cells == expected.cells).all() and grid.origin == expected.origin


@pytest.mark.parametrize(
    ('arguments', 'complaint'),
    [
        (['--resolution', '0'], 'resolution: given 0'),
        (['--resolution', '-1'], 'resolution: given -1'),
        (['--resolution', 'nan'], 'resolution: given nan'),
        (['--resolution', '1e-9'], 'resolution: given 1e-09'),
        (['--resolution', '1e300'], 'resolution: given 1e'),
        (['--height', 'inf'], 'height: given inf'),
        (['--free', '0', 'nan'], 'free.1: given nan'),
        (['--free', '1e300', '0'], 'free.0: given 1e+300; allowed: -1e6 to 1e6 [m]'),
    ],
)
def test_the_tool_names_a_bad_argument_in_one_line(tmp_path, arguments, complaint):
    with pytest.raises(SystemExit) as caught:
        rasterise_world([str(WORLDS / 'hallway.world'), '--out', str(tmp_path / 'm'), *arguments])
    assert complaint in caught.value.code and '\n' not in caught.value.code
    assert not list(tmp_path.iterdir())
