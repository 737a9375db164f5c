"""What catkin installs."""

import re

from places import ROOT


def test_cmake_installs_every_executable_of_scripts_and_rosrun_offers_no_other():
    """catkin_lint must see them by name. rosrun offers each file that may be executed; others run as `bash ...`."""
    listed = re.search(r'set\(executables\n(.*?)\)', (ROOT / 'CMakeLists.txt').read_text(), re.DOTALL)[1].split()
    files = [path for path in (ROOT / 'scripts').iterdir() if path.is_file()]
    assert listed == sorted(f'scripts/{path.name}' for path in files if not path.suffix)
    assert [path.name for path in files if path.suffix and path.stat().st_mode & 0o100] == []


def test_the_images_differ_in_their_base_alone():
    """Only Debian's steps can be run without Docker (scripts/docker/run_steps.sh)."""
    steps = {
        path.stem: [line for line in path.read_text().splitlines() if not line.startswith(('#', 'FROM'))]
        for path in (ROOT / 'scripts' / 'docker').glob('*.Dockerfile')
    }
    assert steps.keys() == {'debian12', 'noetic'}
    assert steps['debian12'] == steps['noetic']
