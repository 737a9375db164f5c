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


def test_a_bad_argument_is_named_and_nothing_written(tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        rasterise_world([str(WORLDS / 'hallway.world'), '--out', str(tmp_path / 'm'), '--free', '0', 'nan'])
    assert caught.value.code == 2 and "argument --free: given 'nan'; allowed: " in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
