"""mapping.launch: what it saves, that a bag gives the same map, and that no fault loses the map so far."""

import signal
import sys
import time

import numpy as np
import pytest

from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED
from launched_graph import DATA, ROOT, Graph, complaints, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

MAPPING = ROOT / 'launch' / 'mapping.launch'
TOUR = 'tour:=%s' % (DATA / 'short_tour.yaml')


@pytest.fixture(scope='module')
def mapped(tmp_path_factory):
    """(folder with map.yaml, map.pgm and tour.bag, output) of a tour."""
    require_ros()
    folder = tmp_path_factory.mktemp('mapping')
    with Graph(folder) as graph:
        launch = graph.launch(MAPPING, TOUR, 'rtf:=0', 'out:=%s' % (folder / 'map'), 'bag:=%s' % (folder / 'tour.bag'))
        assert launch.wait() == 0, launch.output()
        assert graph.is_gone(10.0), 'it left processes behind'
        return folder, launch.output()


def test_the_map_shows_the_walls_where_they_are(mapped):
    grid = load_map(mapped[0] / 'map.yaml')
    assert complaints(mapped[1]) == []
    # The hallway ends at x = -16, and the start is surveyed: the map's frame is the world's.
    assert grid.cells[grid.cell_at(-14.0, 0.0)] == FREE
    row, column = grid.cell_at(-16.0, 0.0)
    assert (grid.cells[row - 5 : row + 6, column - 1 : column + 2] == OCCUPIED).any(axis=1).all()


def test_the_bag_gives_the_same_map_byte_for_byte(mapped):
    folder, _ = mapped
    with Graph(folder / 'offline') as graph:
        code, output = graph.run(
            sys.executable, ROOT / 'scripts' / 'map_bag', folder / 'tour.bag', '-f', folder / 'offline' / 'map'
        )
    assert code == 0, output
    assert 'times real time' in output
    for name in ('map.pgm', 'map.yaml'):
        assert (folder / name).read_bytes() == (folder / 'offline' / name).read_bytes()


def test_what_slam_gmapping_tells(tmp_path):
    """Topics, service and transform while it maps."""
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(MAPPING, TOUR, 'rtf:=1', 'out:=%s' % (tmp_path / 'map'))
        graph.wait_for_clock(1.0)
        for topic, text in (
            ('/map', 'frame_id: "map"'),
            ('/map_metadata', 'resolution: 0.05'),
            ('/slam_gmapping/entropy', 'data:'),
            ('/global_pose', 'frame_id: "map"'),
        ):
            code, output = graph.run('rostopic', 'echo', '--noarr', '-n', '1', topic)
            assert code == 0 and text in output, (topic, output)
        code, output = graph.run('rosservice', 'type', '/dynamic_map')
        assert (code, output.strip()) == (0, 'nav_msgs/GetMap')
        launch.send_signal(signal.SIGINT)
        assert launch.wait() != 0
    # Stopped on the way: the map so far is kept.
    grid = load_map(tmp_path / 'map.yaml')
    assert np.count_nonzero(grid.cells == OCCUPIED) > 50


def test_a_killed_mapper_fails_the_launch_and_leaves_the_map_so_far(tmp_path):
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(MAPPING, TOUR, 'rtf:=1', 'out:=%s' % (tmp_path / 'map'))
        graph.wait_for_clock(4.0)
        graph.run('rosnode', 'kill', '/slam_gmapping')
        assert launch.wait() != 0, launch.output()
        assert graph.is_gone(10.0)
    deadline_s = time.monotonic() + 5.0
    while not (tmp_path / 'map.yaml').is_file():
        assert time.monotonic() < deadline_s
        time.sleep(0.05)
    assert np.count_nonzero(load_map(tmp_path / 'map.yaml').cells == OCCUPIED) > 50


@pytest.mark.parametrize(
    ('arguments', 'texts'),
    [
        (['out:=/etc/hostname/map'], ['save_map', '/etc/hostname', 'cannot write in']),
        (['slam:=upstream'], ['slam: given upstream', 'gmapping', 'ros-noetic-gmapping']),
    ],
)
def test_bad_arguments_are_named_before_anything_starts(tmp_path, arguments, texts):
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(MAPPING, *arguments)
        assert launch.wait() != 0
        for text in texts:
            assert text in launch.output()
