"""Kernels are compiled when they are called, and found by later processes."""

import ast
import importlib
import os
import subprocess
import sys
import tempfile
from types import CodeType, FunctionType

import pytest

from diff_encoder_sim.base import kernels
from diff_encoder_sim.base.kernels import Kernel
from places import SOURCE

# Fixed by costmap_2d, by base_local_planner, and by the layout of a map's patches: numba would not notice a change.
FIXED = {
    *('FREE', 'INSCRIBED', 'LETHAL', 'NO_INFORMATION', 'IN_OBSTACLE', 'IN_UNKNOWN', 'OFF_MAP'),
    *('SIDE', 'SHIFT', 'MASK', 'HITS', 'VISITS', 'MEAN_X', 'MEAN_Y', 'EMPTY'),
}
KERNEL = """
from diff_encoder_sim.base.kernels import compiled

@compiled
def twice(x):
    return 2 * x

@compiled
def total(x):
    return sum([twice(one) for one in range(x)])
"""
CALL = (
    "import sys, kernel; assert 'numba' not in sys.modules; print(kernel.total(4), len(kernel.total.stats.cache_hits))"
)


def start(folder):
    environment = {**os.environ, 'PYTHONPATH': f'{SOURCE}:{folder}', 'NUMBA_CACHE_DIR': str(folder / 'kept')}
    return subprocess.Popen([sys.executable, '-c', CALL], env=environment, stdout=subprocess.PIPE, text=True)


def output(process):
    text, _ = process.communicate()
    assert process.returncode == 0
    return text.split()


def test_processes_that_compile_at_the_same_time_get_the_same_result_and_later_ones_find_the_code(tmp_path):
    (tmp_path / 'kernel.py').write_text(KERNEL)
    assert {output(process)[0] for process in [start(tmp_path) for _ in range(2)]} == {'12'}
    assert output(start(tmp_path)) == ['12', '1']


@pytest.fixture(name='tmp')
def fixture_tmp(tmp_path, monkeypatch):
    """TMPDIR, in a process that can write neither to its home nor to the numba cache."""
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path))
    monkeypatch.setenv('HOME', '/dev/null')
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    monkeypatch.setenv('NUMBA_CACHE_DIR', '')
    monkeypatch.setattr(kernels.numba.config, 'CACHE_DIR', '')
    return tmp_path


def twice_four():
    """The result of a kernel next to which nothing can be written."""
    module = {'__name__': 'unkept'}
    exec(compile(KERNEL, '/proc/version', 'exec'), module)
    return module['twice'](4)


def own_folder(tmp):
    return tmp / f'diff_encoder_sim-{os.geteuid()}'


def test_without_a_writable_package_or_home_code_is_kept_in_a_private_folder(tmp):
    assert twice_four() == 8
    assert own_folder(tmp).stat().st_mode & 0o777 == 0o700
    assert list(own_folder(tmp).rglob('*.nbi'))


@pytest.mark.parametrize('attack', ['writable by others', 'a link'])
def test_a_folder_of_another_user_is_not_used(tmp, caplog, attack):
    elsewhere = tmp / 'elsewhere'
    elsewhere.mkdir(mode=0o700)
    if attack == 'a link':
        own_folder(tmp).symlink_to(elsewhere)
    else:
        own_folder(tmp).mkdir()
        own_folder(tmp).chmod(0o777)
    assert twice_four() == 8
    assert 'NUMBA_CACHE_DIR' in caplog.text
    assert list(tmp.rglob('*.nbi')) == []


def _names(code):
    yield from code.co_names
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield from _names(one)


def test_kernels_use_kernels_and_numbers_of_their_own_file_only():
    files = [file for file in (SOURCE / 'diff_encoder_sim').glob('*/*.py') if '\n@compiled' in file.read_text()]
    assert len(files) > 5
    foreign = set()
    for file in files:
        module = importlib.import_module(f'diff_encoder_sim.{file.parent.name}.{file.stem}')
        imports = [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.ImportFrom)]
        imported = {alias.asname or alias.name for node in imports for alias in node.names}
        for name, kernel in vars(module).items():
            if isinstance(kernel, Kernel) and kernel.__module__ == module.__name__:
                for used in set(_names(kernel.py_func.__code__)) & set(vars(module)):
                    value = getattr(module, used)
                    if isinstance(value, (Kernel, FunctionType)):
                        is_own = value.__module__ == module.__name__
                    else:
                        is_own = not isinstance(value, (int, float)) or used not in imported
                    if not is_own and used not in FIXED:
                        foreign.add(f'{file.stem}.{name}: {used}')
    assert not foreign
