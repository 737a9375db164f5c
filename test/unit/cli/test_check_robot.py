"""check_robot: what is found, whether it drives, and the robot file that is written."""

import re

import pytest
import yaml

from diff_encoder_sim.cli.check_robot import main
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.trials.robot_params import load_robot
from places import ROOT

KOBUKI = ROOT / 'urdf' / 'kobuki.urdf.xacro'


def test_what_is_found_and_checked_is_printed_with_a_verdict(capsys):
    main([str(KOBUKI)])
    out = capsys.readouterr().out
    assert 'wheel diameter [m]' in out and 'libgazebo_ros_diff_drive.so' in out
    assert 'straight, forward' in out and 'NOT OK' not in out
    assert out.splitlines()[-1] == 'kobuki: all checks are ok.'


def test_a_robot_that_fails_ends_with_status_1_and_what_to_do(tmp_path, capsys):
    weak = tmp_path / 'weak.yaml'
    weak.write_text(yaml.safe_dump({'urdf': str(KOBUKI), 'set': {'simulator.drive.wheel_torque': 0.001}}))
    with pytest.raises(SystemExit) as ended:
        main([str(weak)])
    assert 'weak.yaml: the robot fails its self-check: ' in str(ended.value.code)
    out = capsys.readouterr().out
    assert 'NOT OK' in out and 'a higher simulator.drive.wheel_torque' in out


def test_the_written_file_means_the_same_robot(tmp_path, capsys):
    path = tmp_path / 'robots' / 'mine.yaml'
    main([str(KOBUKI), '--write', str(path)])
    assert f'Written: {path}' in capsys.readouterr().out
    written, found = (load_robot(str(each), tmp_path, ROOT, {}) for each in (path, KOBUKI))
    assert written.settings == found.settings
    assert written.description.left == found.description.left and written.description.right == found.description.right
    assert written.description.footprint == found.description.footprint
    text = path.read_text()
    # AMCL takes less of a scan than the scanner gives.
    assert re.search(r'amcl.laser_max_range: 3.5 +# \[m\]\n', text)
    assert '# ppr: 90 ' in text and '# [m] libgazebo_ros_diff_drive.so' in text
    assert not any(line != line.rstrip() for line in text.splitlines())


def test_a_robot_without_a_laser_gets_one_from_its_robot_file(tmp_path, capsys):
    blind, path = tmp_path / 'blind.urdf', tmp_path / 'blind.yaml'
    urdf = expand(RobotSource(KOBUKI))
    blind.write_text(urdf.replace('"laser"', '"box"'))
    blind.write_text(re.sub(r'<sensor.*?</sensor>', '', blind.read_text(), flags=re.DOTALL))
    main([str(blind), '--write', str(path)])
    out = capsys.readouterr().out
    assert 'straight, forward' in out and 'all checks are ok' in out
    line = re.search(r'a robot file \(YAML\): (\{.*\})', out)[1]
    assert yaml.safe_load(line)['laser']['parent'] == 'base_footprint'
    text = path.read_text()
    assert '# laser: {parent: base_footprint, xyz: [0.0, 0.0, 0.' in text
    path.write_text(text.replace('# laser: ', 'laser: '))
    main([str(path)])
    assert 'all checks are ok' in capsys.readouterr().out


def test_a_file_that_exists_is_not_overwritten(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('mine')
    with pytest.raises(SystemExit, match='--write: .*mine.yaml exists; allowed: the path of a new file'):
        main([str(KOBUKI), '--write', str(path)])
    assert path.read_text() == 'mine'


def test_a_robot_file_keeps_what_its_user_knows(tmp_path):
    path = tmp_path / 'copy.yaml'
    main(['kobuki', '--write', str(path)])
    content = yaml.safe_load(path.read_text())
    assert content['ppr'] == pytest.approx(2578.333, abs=1e-3)
    assert content['set']['config.counter_modulus'] == 65536


@pytest.mark.parametrize(
    ('arguments', 'expected'),
    [
        (['nobody'], "given 'nobody', but there is no"),
        ([str(KOBUKI), '--robot-arg', 'size'], "--robot-arg: given 'size'; allowed: name:=value"),
        ([str(KOBUKI), '--packages', '/nowhere'], "packages: given '/nowhere'"),
    ],
)
def test_mistakes_are_one_line(arguments, expected):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert expected in str(ended.value.code) and '\n' not in str(ended.value.code)


def test_a_path_is_written_as_people_read_it(tmp_path):
    (tmp_path / 'mein rührer.urdf').write_text(expand(RobotSource(KOBUKI)), encoding='utf-8')
    main([str(tmp_path / 'mein rührer.urdf'), '--write', str(tmp_path / 'mine.yaml')])
    assert 'urdf: mein rührer.urdf' in (tmp_path / 'mine.yaml').read_text(encoding='utf-8')


def test_a_robot_file_in_a_place_that_cannot_be_written_to_is_one_line(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(SystemExit, match='--write: .*mine.yaml cannot be written: '):
        main([str(KOBUKI), '--write', str(tmp_path / 'file' / 'mine.yaml')])


def test_a_robot_file_needs_the_name_of_one(tmp_path):
    with pytest.raises(SystemExit, match='--write: given .*mine; allowed: a name that ends in .yaml or .yml'):
        main([str(KOBUKI), '--write', str(tmp_path / 'mine')])
