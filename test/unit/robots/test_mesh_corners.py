import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.meshes import file_corners_m, is_listed, link_corners_m, listed_mesh, mesh_name
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, finder, mesh_shape, random_rotation, write_binary_stl


def no_file(_uri):
    return None


def test_listed_corners_keep_all_their_digits():
    corners_m = random_rotation(np.random.default_rng(11)) / 3
    uri = listed_mesh('package://p/meshes/a.stl', corners_m)
    assert is_listed(uri)
    assert (file_corners_m(uri, 'my.urdf', no_file) == corners_m).all()


@pytest.mark.parametrize('uri', ['package://p/meshes/a.stl', 'file:///m/a.stl', 'meshes/a.stl', 'a.stl'])
def test_a_mesh_is_named_by_its_file_listed_or_not(uri):
    assert not is_listed(uri)
    assert mesh_name(uri) == mesh_name(listed_mesh(uri, CUBE_CORNERS)) == 'a.stl'


def test_a_name_with_a_colon_does_no_harm():
    assert (file_corners_m(listed_mesh('a:b.stl', CUBE_CORNERS), 'my.urdf', no_file) == CUBE_CORNERS).all()


def test_listed_again_corners_of_a_file_are_the_same(tmp_path):
    write_binary_stl(tmp_path / 'a.stl', CUBE_CORNERS / 7, CUBE_TRIANGLES)
    read_m = file_corners_m('a.stl', 'my.urdf', finder(tmp_path))
    listed = listed_mesh('a.stl', read_m)
    assert (file_corners_m(listed, 'my.urdf', no_file) == read_m).all()
    assert len(listed) < 300, 'digits that the file does not have'


def test_corners_in_the_link_are_scaled_then_turned_then_moved():
    shape = mesh_shape(listed_mesh('a.stl', np.array([[1.0, 0, 0]])), 2.0, (0, 0, 3), (0, 0, np.pi / 2))
    assert link_corners_m(shape, 'my.urdf', no_file) == pytest.approx(np.array([[0, 2, 3]]))


@pytest.mark.parametrize(
    'uri', ['corners:', 'corners:a', 'corners:a:', 'corners:a:1 2', 'corners:a:1 2 3 4', 'corners:a:1 2 nan']
)
def test_a_list_that_is_no_corners_is_one_line(uri):
    with pytest.raises(ConfigError, match='^my.urdf: given [^\n]*; allowed: [^\n]*$'):
        file_corners_m(uri, 'my.urdf', no_file)
