"""Nodes without the package dynamic_reconfigure."""

import subprocess
import sys

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

WITHOUT_PACKAGE = """
import sys
sys.modules['dynamic_reconfigure'] = None  # as if it were not installed
from diff_encoder_sim.ros import amcl_node, move_base_node, reconfiguration
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.ros.amcl_reconfiguration import serve_amcl
from diff_encoder_sim.ros.navigation_reconfiguration import NavigationReconfiguration

assert serve_amcl(AmclParams(), print) == []
assert NavigationReconfiguration(NavigatorParams(), print)._servers == []
"""


def test_without_the_package_nothing_is_served_and_the_nodes_work():
    done = subprocess.run([sys.executable, '-c', WITHOUT_PACKAGE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, ''), done.stderr
