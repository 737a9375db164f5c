"""Machine code of kernels is that of their sources as they are now."""

import os
import subprocess
import sys

from places import SOURCE

VALUES = """
import numpy

FACTOR = {factor}
WEIGHTS = numpy.zeros(3000)
WEIGHTS[1500] = {weight}
"""
CALLEE = """
from diff_encoder_sim.base.compiled import compiled
from values import FACTOR, WEIGHTS

@compiled
def times(x):
    return FACTOR * x + {term} * int(WEIGHTS[1500])
"""
CALLER = """
from diff_encoder_sim.base.compiled import compiled
from callee import times

@compiled
def total(x):
    return sum([times(one) for one in range(x)])
"""
CALL = 'from caller import total; print(total(3), len(total.stats.cache_hits))'
EDITED_AFTER_IMPORT = """
import pathlib, caller, callee
file = pathlib.Path(callee.__file__)
file.write_text(file.read_text().replace('+ 0', '+ 5'))
print(caller.total(3), len(caller.total.stats.cache_hits))
"""


def called(folder, call=CALL):
    """Return what the caller returns, and whether its machine code was found."""
    environment = {**os.environ, 'PYTHONPATH': f'{SOURCE}:{folder}', 'NUMBA_CACHE_DIR': str(folder / 'kept')}
    # Python, too, would take bytecode of equal time and size for new.
    return subprocess.check_output([sys.executable, '-B', '-c', call], env=environment, text=True).split()


def write(folder, factor=2, weight=1, term=0):
    """Write the sources, all of the same time and size."""
    (folder / 'values.py').write_text(VALUES.format(factor=factor, weight=weight))
    (folder / 'callee.py').write_text(CALLEE.format(term=term))
    (folder / 'caller.py').write_text(CALLER)
    for file in folder.glob('*.py'):
        os.utime(str(file), (1e9, 1e9))


def test_a_kernel_is_compiled_again_when_one_that_it_calls_has_changed(tmp_path):
    write(tmp_path)
    assert called(tmp_path) == ['6', '0']
    assert called(tmp_path) == ['6', '1']
    write(tmp_path, term=1)
    assert called(tmp_path) == ['9', '0']


def test_a_kernel_is_compiled_again_when_an_imported_number_of_one_that_it_calls_has_changed(tmp_path):
    write(tmp_path)
    assert called(tmp_path) == ['6', '0']
    write(tmp_path, factor=3)
    assert called(tmp_path) == ['9', '0']


def test_a_kernel_is_compiled_again_when_an_imported_array_has_changed(tmp_path):
    write(tmp_path, term=1)
    assert called(tmp_path) == ['9', '0']
    write(tmp_path, term=1, weight=4)
    assert called(tmp_path) == ['18', '0']


def test_a_kernel_is_not_compiled_again_for_the_time_of_a_file(tmp_path):
    write(tmp_path)
    assert called(tmp_path) == ['6', '0']
    for file in tmp_path.glob('*.py'):
        os.utime(str(file), (2e9, 2e9))
    assert called(tmp_path) == ['6', '1']


def test_code_of_a_source_that_was_edited_after_its_import_is_not_taken_for_that_of_the_edited_one(tmp_path):
    write(tmp_path)
    assert called(tmp_path, EDITED_AFTER_IMPORT) == ['6', '0']
    assert called(tmp_path) == ['21', '0']
