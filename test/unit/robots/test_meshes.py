import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.meshes import mesh_points_m
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, WRITERS, write_binary_stl, write_dae, write_obj

WHERE = "my.urdf: link 'base': collision mesh 'a.stl'"


def extents_m(points_m):
    return np.array([points_m.min(axis=0), points_m.max(axis=0)])


@pytest.mark.parametrize('name', sorted(WRITERS))
def test_every_format_gives_the_corners(tmp_path, name):
    WRITERS[name](tmp_path / name, CUBE_CORNERS * [1, 2, 3] + [4, 5, 6], CUBE_TRIANGLES)
    assert extents_m(mesh_points_m(tmp_path / name, WHERE)) == pytest.approx(np.array([[3, 3, 3], [5, 7, 9]]))


@pytest.mark.parametrize('name', ['text.stl', 'part.obj', 'binary.stl'])
@pytest.mark.parametrize('word', ['Gehäuse'.encode('latin-1'), 'корпус'.encode(), b'\xff\xfe\x80'])
def test_names_in_a_mesh_may_be_in_any_encoding(tmp_path, name, word):
    WRITERS[name](tmp_path / name, CUBE_CORNERS, CUBE_TRIANGLES)
    content = (tmp_path / name).read_bytes()
    named = {'text.stl': content.replace(b'part', word), 'part.obj': b'# ' + word + b'\n' + content}
    (tmp_path / name).write_bytes(named.get(name, word + content[len(word) :]))
    assert extents_m(mesh_points_m(tmp_path / name, WHERE)) == pytest.approx(extents_m(CUBE_CORNERS))


def nested(levels, width, inside):
    """A library of nodes, each with instances of the next one."""
    nodes = [
        f'<node id="n{level}">{width * f"""<instance_node url="#n{level + 1}"/>"""}</node>' for level in range(levels)
    ]
    return f'<library_nodes>{"".join(nodes)}<node id="n{levels}">{inside}</node></library_nodes>'


@pytest.mark.parametrize(('levels', 'width', 'is_read'), [(3, 3, True), (20, 10, False), (1, 2001, False)])
@pytest.mark.parametrize('inside', ['<instance_geometry url="#part"/>', ''])
def test_instances_of_a_dae_are_counted_before_they_are_shown(tmp_path, levels, width, is_read, inside):
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES, node='<instance_node url="#n0"/>')
    text = (tmp_path / 'a.dae').read_text()
    text = text.replace('<library_visual', nested(levels, width, inside) + '<library_visual')
    (tmp_path / 'a.dae').write_text(text)
    if is_read:
        assert len(mesh_points_m(tmp_path / 'a.dae', WHERE)) == 8
    else:
        with pytest.raises(ConfigError, match='more than [0-9]+ (nodes|instances)'):
            mesh_points_m(tmp_path / 'a.dae', WHERE)


def test_a_corner_that_no_triangle_has_does_not_count(tmp_path):
    stray = np.vstack([CUBE_CORNERS, [9, 9, 9]])
    for name, write in (('a.obj', write_obj), ('a.dae', write_dae)):
        write(tmp_path / name, stray, CUBE_TRIANGLES)
        assert mesh_points_m(tmp_path / name, WHERE).max() == 1


def test_a_dae_is_scaled_by_its_unit(tmp_path):
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES, unit_m=0.0254)
    assert extents_m(mesh_points_m(tmp_path / 'a.dae', WHERE)) == pytest.approx(0.0254 * extents_m(CUBE_CORNERS))


@pytest.mark.parametrize('up_axis', ['X_UP', 'Y_UP', 'Z_UP'])
def test_the_up_axis_of_a_dae_is_left_alone_as_rviz_and_gazebo_do(tmp_path, up_axis):
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS * [1, 2, 3], CUBE_TRIANGLES, up_axis=up_axis)
    assert mesh_points_m(tmp_path / 'a.dae', WHERE).max(axis=0).tolist() == [1, 2, 3]


def test_nodes_of_a_dae_move_what_they_show(tmp_path):
    node = '<translate>10 0 0</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>'
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES, node=node)
    found = extents_m(mesh_points_m(tmp_path / 'a.dae', WHERE))
    assert found == pytest.approx(np.array([[9, -2, -1], [11, 2, 1]]), abs=1e-5)


def test_a_part_of_a_dae_whose_material_is_missing_counts(tmp_path):
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES)
    bound = '<technique_common><instance_material symbol="m" target="#m"/></technique_common>'
    shown = f'url="#part"><bind_material>{bound}</bind_material></instance_geometry>'
    text = (tmp_path / 'a.dae').read_text().replace('url="#part"/>', shown)
    (tmp_path / 'b.dae').write_text(text)
    assert mesh_points_m(tmp_path / 'b.dae', WHERE).max() == 1


def test_points_inside_a_mesh_are_left_out(tmp_path):
    corners = np.vstack([CUBE_CORNERS, 0.5 * CUBE_CORNERS])
    write_obj(tmp_path / 'a.obj', corners, np.vstack([CUBE_TRIANGLES, 8 + CUBE_TRIANGLES]))
    assert len(mesh_points_m(tmp_path / 'a.obj', WHERE)) == 8


def test_an_edited_mesh_is_read_again(tmp_path):
    write_obj(tmp_path / 'a.obj', CUBE_CORNERS, CUBE_TRIANGLES)
    mesh_points_m(tmp_path / 'a.obj', WHERE)
    write_obj(tmp_path / 'a.obj', 2 * CUBE_CORNERS, CUBE_TRIANGLES)
    assert mesh_points_m(tmp_path / 'a.obj', WHERE).max() == 2


BROKEN = {
    'empty.stl': b'',
    'empty.obj': b'',
    'empty.dae': b'',
    'words.stl': b'this is no mesh at all, nor has it 84 bytes of a header',
    'words.obj': b'this is no mesh at all',
    'words.dae': b'this is no mesh at all',
    'no_triangles.obj': b'v 0 0 0\nv 1 0 0\nv 0 1 0\n',
    'no_triangles.stl': b'solid x\nendsolid x\n',
    'wrong_index.obj': b'v 0 0 0\nv 1 0 0\nf 1 2 7\n',
    'other.dae': b'<robot/>',
    'entities.dae': b'<!DOCTYPE x [<!ENTITY a "aaaa">]><COLLADA>&a;</COLLADA>',
    'html.stl': b'<!DOCTYPE html><html>404: Not Found</html>' * 9,
    'pointer.stl': b'version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n',
}


@pytest.mark.parametrize('name', sorted(BROKEN))
def test_a_broken_mesh_is_one_line_that_names_it(tmp_path, name, capfd, caplog):
    (tmp_path / name).write_bytes(BROKEN[name])
    assert_one_line(tmp_path / name)
    assert capfd.readouterr() == ('', '')


def test_a_torn_file_is_one_line(tmp_path):
    write_binary_stl(tmp_path / 'a.stl', CUBE_CORNERS, CUBE_TRIANGLES)
    (tmp_path / 'a.stl').write_bytes((tmp_path / 'a.stl').read_bytes()[:-70])
    assert_one_line(tmp_path / 'a.stl')


@pytest.mark.parametrize('value', [np.nan, np.inf])
def test_corners_that_are_no_numbers_are_one_line(tmp_path, value):
    write_binary_stl(tmp_path / 'a.stl', np.vstack([CUBE_CORNERS[:-1], [[0, 0, value]]]), CUBE_TRIANGLES)
    assert 'no numbers' in assert_one_line(tmp_path / 'a.stl')


def test_a_file_of_500_mb_is_not_read(tmp_path):
    with (tmp_path / 'a.stl').open('wb') as file:
        file.truncate(500_000_000)
    assert 'given 500 MB; allowed: up to 50 MB' in assert_one_line(tmp_path / 'a.stl')


def test_a_dae_that_shows_a_part_too_often_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr('diff_encoder_sim.robots.meshes._MOST_POINTS', 80)
    write_dae(tmp_path / 'a.dae', CUBE_CORNERS, CUBE_TRIANGLES, instances=11)
    assert 'more than 80 corners' in assert_one_line(tmp_path / 'a.dae')


def test_a_missing_file_and_an_unknown_format_are_one_line(tmp_path):
    assert 'which is no file' in assert_one_line(tmp_path / 'a.stl')
    (tmp_path / 'a.step').write_text('')
    assert "given '.step'; allowed: .stl, .obj, .dae" in assert_one_line(tmp_path / 'a.step')
    assert 'which is no file' in assert_one_line(tmp_path)


def test_random_changes_of_a_mesh_give_points_or_one_line(tmp_path):
    rng = np.random.default_rng(1)
    for name, write in WRITERS.items():
        write(tmp_path / name, CUBE_CORNERS, CUBE_TRIANGLES)
        content = np.frombuffer((tmp_path / name).read_bytes(), np.uint8)
        for trial in range(25):
            changed = content.copy()
            changed[rng.integers(0, len(content), 5)] = rng.integers(0, 256, 5)
            path = tmp_path / f'{trial}{(tmp_path / name).suffix}'
            path.write_bytes(changed[: rng.integers(0, len(content)) if trial % 3 == 0 else None].tobytes())
            try:
                assert np.isfinite(mesh_points_m(path, WHERE)).all()
            except ConfigError:
                assert_one_line(path)


def assert_one_line(path):
    with pytest.raises(ConfigError) as caught:
        mesh_points_m(path, WHERE)
    text = str(caught.value)
    assert text.startswith(f'{WHERE}: given ')
    assert '; allowed: ' in text
    assert len(text.splitlines()) == 1
    assert len(text) < 400
    return text
