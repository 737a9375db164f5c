"""The command that draws a map from a world file."""

import pytest

from diff_encoder_sim.cli.rasterise_world import main as rasterise_world
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world
from places import WORLDS


def test_the_tool_writes_a_map_that_is_read_back(tmp_path, capsys):
    world_file = str(WORLDS / 'hallway.world')
    rasterise_world([world_file, '--free', '-10', '0', '--resolution', '0.1', '--out', str(tmp_path / 'hall')])
    assert capsys.readouterr().out.strip() == str(tmp_path / 'hall.yaml')
    grid, expected = load_map(tmp_path / 'hall.yaml'), rasterise(load_world(world_file), 1.12, 0.1, -10.0, 0.0)
    assert (grid.cells == expected.cells).all() and grid.origin == expected.origin


@pytest.mark.parametrize('arguments', ['--resolution 0', '--height inf', '--free 0 nan'])
def test_the_tool_names_a_bad_argument_in_one_line(tmp_path, capsys, arguments):
    with pytest.raises(SystemExit) as caught:
        rasterise_world([str(WORLDS / 'hallway.world'), '--out', str(tmp_path / 'm'), *arguments.split()])
    (line,) = [line for line in capsys.readouterr().err.splitlines() if 'error' in line]
    assert caught.value.code == 2 and f'argument {arguments.split()[0]}: given ' in line and 'allowed: ' in line
    assert not list(tmp_path.iterdir())
