"""What catkin installs."""

import re

from places import ROOT


def test_cmake_installs_every_executable_of_scripts():
    """catkin_lint must see them by name, so they are listed."""
    listed = re.search(r'set\(executables\n(.*?)\)', (ROOT / 'CMakeLists.txt').read_text(), re.DOTALL)[1].split()
    folder = (ROOT / 'scripts').iterdir()
    assert listed == sorted(f'scripts/{path.name}' for path in folder if path.is_file() and not path.suffix)


def test_rosrun_offers_only_what_is_installed():
    """It offers each file that may be executed; setup.sh and its like run as `bash scripts/setup.sh`."""
    executable = [path.name for path in (ROOT / 'scripts').iterdir() if path.is_file() and path.stat().st_mode & 0o100]
    assert [name for name in executable if '.' in name] == []


def test_the_images_differ_in_their_base_alone():
    """Only Debian's steps can be run without Docker (scripts/docker/run_steps.sh)."""
    steps = {
        path.stem: [line for line in path.read_text().splitlines() if not line.startswith(('#', 'FROM'))]
        for path in (ROOT / 'scripts' / 'docker').glob('*.Dockerfile')
    }
    assert steps.keys() == {'debian12', 'noetic'}
    assert steps['debian12'] == steps['noetic']
