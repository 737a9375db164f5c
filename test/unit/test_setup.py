"""scripts/setup.sh on a system without Noetic: it says what runs there, and what to type for that."""

import shutil
import subprocess
import sys

import pytest

from places import ROOT


@pytest.fixture(name='set_up')
def fixture_set_up(tmp_path):
    """Runs setup.sh of a checkout where it reads that the system is of another release: status and stderr."""
    shutil.copytree(str(ROOT / 'scripts'), str(tmp_path / 'scripts'))

    def set_up(release, *arguments):
        (tmp_path / 'os-release').write_text(f'ID=ubuntu\nVERSION_CODENAME={release}\n')
        elsewhere = 'mount --bind os-release /etc/os-release && exec bash scripts/setup.sh "$@"'
        command = ['unshare', '--map-root-user', '--mount', 'bash', '-c', elsewhere, 'setup', *arguments]
        done = subprocess.run(command, cwd=str(tmp_path), capture_output=True, text=True)
        if 'unshare failed' in done.stderr or 'mount: ' in done.stderr:
            pytest.skip(f'this user may not mount: {done.stderr}')
        return done.returncode, done.stderr

    return set_up


def test_it_offers_the_part_without_ros_where_there_is_no_noetic_which_has_no_tests(set_up):
    status, said = set_up('jammy')
    reason, offer = said.splitlines()
    assert status == 1 and 'this system (jammy) has no ROS Noetic' in reason
    assert offer.endswith(': bash scripts/setup.sh --without-ros')
    status, said = set_up('jammy', '--without-ros', '--test')
    assert (status, len(said.splitlines())) == (1, 1) and '--without-ros' in said


def test_kernels_are_compiled_again_when_any_source_has_changed(tmp_path):
    shutil.copytree(str(ROOT / 'scripts'), str(tmp_path / 'scripts'))
    script, numbers = tmp_path / 'scripts' / 'setup.sh', tmp_path / 'src' / 'numbers.py'
    script.write_text(script.read_text().replace('\nmain "$@"\n', '\nstep() { echo "$1"; }; compile_kernels\n'))
    (tmp_path / '.venv' / 'bin').mkdir(parents=True)
    (tmp_path / '.venv' / 'bin' / 'python').symlink_to(sys.executable)
    (tmp_path / '.venv' / '.stamp-requirements.txt').touch()
    numbers.parent.mkdir()

    def compiled_with(number):
        numbers.write_text(f'LETHAL = {number}')
        return subprocess.check_output(['bash', str(script)], text=True)

    assert [compiled_with(number) for number in (254, 254, 250)] == ['compiling kernels\n', '', 'compiling kernels\n']
