"""ALTO's file, as ROS's own parser reads it."""

import shutil
import subprocess

import pytest

from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expand
from places import ROOT


@pytest.mark.parametrize('root_inertia', ['true', 'false'])
@pytest.mark.skipif(shutil.which('check_urdf') is None, reason='check_urdf is not installed')
def test_check_urdf_passes(tmp_path, root_inertia):
    path = tmp_path / 'alto.urdf'
    path.write_text(expand(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro', (('root_inertia', root_inertia),))))
    result = subprocess.run(['check_urdf', str(path)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert result.returncode == 0 and 'Successfully Parsed' in result.stdout, result.stdout
