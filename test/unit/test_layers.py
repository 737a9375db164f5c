"""The rooms of the package import in one direction, and none but ros/ knows ROS."""

import ast
import os
import re
import subprocess
import sys

import pytest

from places import SOURCE

PACKAGE = SOURCE / 'diff_encoder_sim'

# Which room imports which: a room may import those of its line, all of which stand above it.
MAY_IMPORT = {
    'base': '',
    'wheels': 'base',
    'robots': 'base',
    'localization': 'base wheels',
    'simulation': 'base robots localization',
    'navigation': 'base localization',
    'drives': 'base wheels localization simulation navigation',
    'trials': 'base wheels robots localization simulation navigation drives',
    'analysis': 'base wheels localization drives trials',
    'calibration': 'base localization simulation drives analysis',
    'conformance': 'base drives analysis',
    'advice': 'base wheels robots localization simulation navigation drives trials analysis',
    'api': 'base wheels robots localization simulation drives trials analysis calibration conformance advice',
    'cli': 'base localization calibration trials api',
    'ros': 'base wheels robots localization simulation navigation drives trials conformance',
}

ROS_MODULES = (
    r'(rospy|roslib|rosgraph|roslaunch|genpy|tf2_ros|tf2_py|actionlib|dynamic_reconfigure)(\.|$)|.*_(msgs|srvs)(\.|$)'
)

# Libraries of seconds or many megabytes, and the modules that are not imported before what they wrap is needed.
HEAVY = ('numba', 'pybullet', 'dask', 'distributed', 'altair', 'vl_convert', 'scipy')
WRAPPERS = (
    *(f'analysis.charts.{name}' for name in ('chart_page', 'drawings', 'figures', 'frames', 'trial_charts')),
    *(
        'analysis.report.page',
        'advice.advice_page',
        'advice.imu_charts',
        'calibration.calibration_page',
        'calibration.drive_page',
    ),
    'conformance.conformance_page',
)
IMPORT_AND_NAME_THE_HEAVY = f"""
import importlib, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
print([name for name in {HEAVY} if name in sys.modules])
"""

COUNT_OURS = """
import importlib, sys
module = importlib.import_module(sys.argv[1])
if hasattr(module, 'API'):
    importlib.import_module(f'diff_encoder_sim.{module.API}')
print(sum(name.split('.')[0] == 'diff_encoder_sim' and name.split('.')[1:2] != ['msg'] for name in sys.modules))
"""
# The most modules of the package that a command may import; generated messages are left out.
MOST_MODULES = {'ros.wheel_nodes': 40, 'cli.analyze': 90, 'cli.campaign': 130}


def imported_modules(path):
    """Full names of all that a file imports, inside functions too; of `from a import b` both a and a.b."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}: relative import'
            yield node.module
            yield from (f'{node.module}.{alias.name}' for alias in node.names)


def test_every_module_is_in_a_room_of_the_table_which_goes_one_way():
    assert sorted(MAY_IMPORT) == sorted(path.parent.name for path in PACKAGE.glob('*/__init__.py'))
    assert [path.name for path in PACKAGE.glob('*.py')] == ['__init__.py']
    above = set()
    for room, allowed in MAY_IMPORT.items():
        assert set(allowed.split()) <= above, room
        above.add(room)


@pytest.mark.parametrize('room', MAY_IMPORT)
def test_a_room_imports_only_the_rooms_of_its_line(room):
    found = {}
    for path in (PACKAGE / room).rglob('*.py'):
        for name in imported_modules(path):
            match = re.match(r'diff_encoder_sim\.(\w+)', name)
            if match and match[1] not in (room, 'msg', 'cfg'):
                found.setdefault(match[1], str(path.relative_to(PACKAGE)))
    others = {other: path for other, path in found.items() if other not in MAY_IMPORT[room].split()}
    assert others == {}
    assert set(MAY_IMPORT[room].split()) == set(found), 'the table allows what is not used'


def output_of(code, *arguments, **environment):
    done = subprocess.run([sys.executable, '-c', code, *arguments], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_the_core_imports_neither_ros_nor_a_heavy_library_before_it_is_needed():
    paths = [path for path in PACKAGE.rglob('*.py') if path.relative_to(PACKAGE).parts[0] not in ('ros', 'msg')]
    names = sorted('.'.join(path.relative_to(SOURCE).with_suffix('').parts) for path in paths)
    wrappers = tuple(f'diff_encoder_sim.{name}' for name in WRAPPERS)
    light = [name for name in names if not name.startswith(wrappers)]
    assert 100 < len(light) < len(names)
    assert output_of(IMPORT_AND_NAME_THE_HEAVY, *light, PYTHONPATH=str(SOURCE), PATH='') == '[]'


def test_only_the_ros_folder_names_ros_modules():
    """Also inside functions, which importing a module does not run."""
    offenders = [
        f'{path.relative_to(PACKAGE)}: {name}'
        for path in PACKAGE.rglob('*.py')
        if path.relative_to(PACKAGE).parts[0] not in ('ros', 'msg')
        for name in imported_modules(path)
        if re.match(ROS_MODULES, name)
    ]
    assert offenders == []


@pytest.mark.parametrize('name', MOST_MODULES)
def test_a_command_imports_few_modules(name):
    path = str(SOURCE)
    if name.startswith('ros.'):
        pytest.importorskip('rospy')
        pytest.importorskip('diff_encoder_sim.msg')
        path = os.environ['PYTHONPATH']
    assert (
        int(output_of(COUNT_OURS, f'diff_encoder_sim.{name}', **{**os.environ, 'PYTHONPATH': path}))
        <= MOST_MODULES[name]
    )
