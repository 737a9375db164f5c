"""Kernels are compiled when they are called, and found by later processes."""

import ast
import importlib
import os
import subprocess
import sys
from types import CodeType, FunctionType

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


def test_where_no_code_can_be_kept_a_warning_is_logged(tmp_path, monkeypatch, caplog):
    (tmp_path / 'unkept.py').write_text(KERNEL)
    monkeypatch.syspath_prepend(tmp_path)
    unkept = importlib.import_module('unkept')
    (tmp_path / 'unkept.py').unlink()  # numba finds no folder for a function without a file
    assert unkept.twice(4) == 8
    assert 'NUMBA_CACHE_DIR' in caplog.text


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
