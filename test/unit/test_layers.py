"""The core must run where there is no ROS."""

import subprocess
import sys

from places import SOURCE

IMPORT_ALL_WITHOUT_ROS = """
import importlib, pkgutil, re, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if re.match(r'(rospy|roslib|rosgraph|rospkg|roslaunch|genpy|tf2_ros|tf2_py|actionlib)(\\.|$)|.*_(msgs|srvs)(\\.|$)', name):
            raise ImportError('blocked: ' + name)

sys.meta_path.insert(0, NoRos())
import diff_encoder_sim
names = [m.name for m in pkgutil.walk_packages(diff_encoder_sim.__path__, 'diff_encoder_sim.',
                                               onerror=lambda name: None)]
core = [n for n in names if not re.match(r'diff_encoder_sim\\.(ros|msg)(\\.|$)', n)]
for name in core:
    importlib.import_module(name)
print(len(core))
"""


def test_every_core_module_imports_with_ros_blocked():
    result = subprocess.run(
        [sys.executable, '-c', IMPORT_ALL_WITHOUT_ROS],
        cwd=str(SOURCE),
        env={'PYTHONPATH': str(SOURCE), 'PATH': ''},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    assert int(result.stdout.split()[-1]) >= 20


def test_only_the_ros_folder_names_ros_modules():
    """Also catches imports inside functions, which importing a module does not run."""
    offenders = [
        f'{path}:{number}'
        for path in (SOURCE / 'diff_encoder_sim').rglob('*.py')
        if 'ros' not in path.relative_to(SOURCE / 'diff_encoder_sim').parts[:1]
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if line.strip().startswith(('import ', 'from '))
        and any(word in line for word in ('rospy', 'tf2', '_msgs', '_srvs', 'roslib'))
    ]
    assert offenders == []


def test_only_tools_and_nodes_use_the_command_line():
    offenders = [
        str(path)
        for path in (SOURCE / 'diff_encoder_sim').rglob('*.py')
        if path.relative_to(SOURCE / 'diff_encoder_sim').parts[0] not in ('cli', 'ros')
        and 'diff_encoder_sim.cli' in path.read_text()
    ]
    assert offenders == []
