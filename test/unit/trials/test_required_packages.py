"""Packages that a launch argument needs: named, with how to install them, before anything starts."""

import sys
from types import SimpleNamespace

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.required_packages import GAZEBO, UPSTREAM_NAVIGATION, require


def test_every_missing_package_is_named_with_the_argument_that_needs_it(monkeypatch):
    installed = {'map_server', 'amcl'}
    packages = SimpleNamespace(RosPack=lambda: SimpleNamespace(list=lambda: installed))
    monkeypatch.setitem(sys.modules, 'rospkg', packages)
    missing = '^nav: given upstream, but move_base, dwa_local_planner are not installed: apt'
    with pytest.raises(ConfigError, match=missing):
        require(UPSTREAM_NAVIGATION)
    with pytest.raises(ConfigError, match='gazebo_ros is not installed: .* or sim:=pybullet'):
        require(GAZEBO)
    installed.update(UPSTREAM_NAVIGATION.packages)
    require(UPSTREAM_NAVIGATION)
