"""scripts/setup.sh compiles kernels when it must."""

import shutil
import subprocess
import sys

from places import ROOT


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
