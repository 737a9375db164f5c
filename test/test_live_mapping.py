"""mapping.launch: what it saves, that a bag gives the same map, and that no fault loses the map so far."""

import subprocess
import sys

import numpy as np
import pytest

from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED
from launched_graph import DATA, ROOT, Graph, complaints, require_ros, wait_until
from node_interfaces import MAPPING, check_interfaces

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

LAUNCH = ROOT / 'launch' / 'mapping.launch'
TOUR = f'tour:={DATA}/short_tour.yaml'


def test_the_map_shows_the_walls_and_a_bag_gives_the_same_map_byte_for_byte(tmp_path):
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(LAUNCH, TOUR, 'rtf:=0', f'out:={tmp_path}/map', f'bag:={tmp_path}/tour.bag')
        check_interfaces(graph, launch, MAPPING)
        assert launch.wait() == 0, launch.output()
        assert graph.is_gone(), 'it left processes behind'
    assert complaints(launch.output()) == []
    grid = load_map(tmp_path / 'map.yaml')
    # The hallway ends at x = -16, and the start is surveyed: the map's frame is the world's.
    assert grid.cells[grid.cell_at(-14.0, 0.0)] == FREE
    row, column = grid.cell_at(-16.0, 0.0)
    assert (grid.cells[row - 5 : row + 6, column - 1 : column + 2] == OCCUPIED).any(axis=1).all()
    (tmp_path / 'offline').mkdir()
    command = [sys.executable, ROOT / 'scripts' / 'map_bag', tmp_path / 'tour.bag', '-f', tmp_path / 'offline' / 'map']
    done = subprocess.run(command, capture_output=True, text=True, timeout=120.0, check=False)
    assert done.returncode == 0 and 'times real time' in done.stdout + done.stderr
    for name in ('map.pgm', 'map.yaml'):
        assert (tmp_path / name).read_bytes() == (tmp_path / 'offline' / name).read_bytes()


def test_a_killed_mapper_fails_the_launch_and_leaves_the_map_so_far(tmp_path):
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(LAUNCH, TOUR, 'rtf:=1', f'out:={tmp_path}/map')
        graph.wait_for_clock(3.0)
        graph.run('rosnode', 'kill', '/slam_gmapping')
        assert launch.wait() != 0, launch.output()
        assert graph.is_gone()
    wait_until((tmp_path / 'map.yaml').is_file, launch, 5.0)
    assert np.count_nonzero(load_map(tmp_path / 'map.yaml').cells == OCCUPIED) > 50
