"""The wheel that pip builds: on its own, without checkout and ROS, it has all that its commands need.

scripts/check_wheel.sh tries the same with clean environments and the libraries from PyPI.
"""

import importlib.util
import os
import subprocess
import sys
import zipfile
from email.parser import Parser

import pytest

from places import ROOT, SOURCE

PACKAGE = 'diff_encoder_sim'
DATA = ('config', 'urdf', 'worlds')


@pytest.fixture(scope='module', name='wheel')
def fixture_wheel(tmp_path_factory):
    if importlib.util.find_spec('hatchling') is None:
        assert not os.environ.get('ROSTESTS_REQUIRED'), 'no hatchling: requirements-test.txt'
        pytest.skip('hatchling is not installed: scripts/setup.sh --test')
    folder = tmp_path_factory.mktemp('wheel')
    pip(['wheel', '--no-deps', '--no-build-isolation', '--wheel-dir', folder, ROOT])
    (path,) = folder.glob('*.whl')
    return path


def pip(arguments):
    options = ['--no-index', '--disable-pip-version-check', '--quiet']
    command = [sys.executable, '-m', 'pip', *map(str, arguments[:1]), *options, *map(str, arguments[1:])]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def run(installed, folder, *arguments):
    environment = {'PATH': '/usr/bin:/bin', 'PYTHONPATH': str(installed), 'HOME': os.environ.get('HOME', '/')}
    command = [sys.executable, str(installed / 'bin' / 'diff-encoder-sim'), *map(str, arguments)]
    done = subprocess.run(command, env=environment, cwd=str(folder), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_it_has_every_module_without_ros_and_every_data_file(wheel):
    source = SOURCE / PACKAGE
    modules = {path.relative_to(SOURCE) for path in source.rglob('*.py') if 'ros' not in path.relative_to(source).parts}
    data = {path.relative_to(ROOT) for name in DATA for path in (ROOT / name).rglob('*') if path.is_file()}
    with zipfile.ZipFile(str(wheel)) as archive:
        names = set(archive.namelist())
    assert {str(path) for path in modules} == {name for name in names if name.endswith('.py')}
    shared = {name for name in names if name.startswith(f'{PACKAGE}/share/')}
    assert shared == {f'{PACKAGE}/share/{name}' for name in ['package.xml', *map(str, data)]}


def test_its_libraries_are_those_of_requirements_txt(wheel):
    with zipfile.ZipFile(str(wheel)) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith('/METADATA')]
        metadata = Parser().parsestr(archive.read(name).decode())
    wanted = [line.split('>')[0] for line in (ROOT / 'requirements.txt').read_text().splitlines() if line[:1].isalpha()]
    needed = [line for line in metadata.get_all('Requires-Dist') if 'extra ==' not in line]
    assert len(needed) == len(wanted)
    assert "pybullet>=3.2.6; python_version < '3.12'" in [line.replace('"', "'") for line in needed]
    extras = {line.replace('"', "'") for line in metadata.get_all('Requires-Dist') if 'extra ==' in line}
    assert extras == {
        "pybullet; extra == 'sim'",
        *(f"{name}>=2023.5; extra == 'cluster'" for name in ('dask', 'distributed')),
    }
    assert {'dask>=2023.5', 'distributed>=2023.5'} <= set((ROOT / 'requirements-test.txt').read_text().splitlines())
    assert f'<version>{metadata["Version"]}</version>' in (ROOT / 'package.xml').read_text()


def test_it_runs_without_the_checkout(wheel, tmp_path):
    installed = tmp_path / 'installed'  # with no libraries: those of the environment serve
    pip(['install', '--no-deps', '--no-compile', '--target', installed, wheel])
    where = 'from diff_encoder_sim.base import package_files; print(package_files.package_folder())'
    environment = {'PYTHONPATH': str(installed)}
    folder = subprocess.run([sys.executable, '-c', where], env=environment, capture_output=True, text=True).stdout
    assert folder == f'{installed}/{PACKAGE}/share\n'
    assert 'all checks are ok' in run(installed, tmp_path, 'check-robot', 'burger')
    world = installed / PACKAGE / 'share' / 'worlds' / 'hallway.world'
    assert run(installed, tmp_path, 'rasterise-world', world, '--out', 'map') == 'map.yaml\n'
    with pytest.raises(AssertionError, match='diff-encoder-sim check-robot: .*burger'):
        run(installed, tmp_path, 'check-robot', 'no_such_robot')
