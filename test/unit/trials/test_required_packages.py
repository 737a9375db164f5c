"""Packages that a launch argument needs: named, with how to install them, before anything starts."""

import sys
from types import SimpleNamespace

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.required_packages import GAZEBO, UPSTREAM_NAVIGATION, require


@pytest.fixture
def installed(monkeypatch):
    names = set()
    packages = SimpleNamespace(RosPack=lambda: SimpleNamespace(list=lambda: names))
    monkeypatch.setitem(sys.modules, 'rospkg', packages)
    return names


def test_installed_packages_are_accepted(installed):
    installed.update(UPSTREAM_NAVIGATION.packages)
    require(UPSTREAM_NAVIGATION)


def test_every_missing_package_is_named_with_the_argument_that_needs_it(installed):
    installed.update({'map_server', 'amcl'})
    with pytest.raises(
        ConfigError, match='^nav: given upstream, but move_base, dwa_local_planner are not installed: apt'
    ):
        require(UPSTREAM_NAVIGATION)
    with pytest.raises(ConfigError, match='gazebo_ros is not installed: .* or sim:=pybullet'):
        require(GAZEBO)
