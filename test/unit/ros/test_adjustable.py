"""Parameters that can be changed while a node runs."""

import math

import pytest

import upstream_params

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import with_changes
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.ros import amcl_reconfiguration, navigation_limits
from diff_encoder_sim.ros.adjustable import RESTORE_DEFAULTS, adjustable, adjustables_of

NAVIGATOR = NavigatorParams()
GROUPS = [
    (AmclParams(), amcl_reconfiguration.LIMITS),
    (NAVIGATOR, navigation_limits.MOVE_BASE),
    (NAVIGATOR.DWAPlannerROS, navigation_limits.DWA),
    (NAVIGATOR.local_costmap, navigation_limits.COSTMAP),
    (NAVIGATOR.local_costmap, navigation_limits.OBSTACLE_LAYER),
    (NAVIGATOR.local_costmap, navigation_limits.INFLATION_LAYER),
]


def test_the_names_are_upstreams():
    """The tables of test/support are typed from upstream's nodes, which read more than they let change."""
    for names, upstream in (
        (amcl_reconfiguration.LIMITS, upstream_params.AMCL),
        (navigation_limits.MOVE_BASE, upstream_params.MOVE_BASE_NAMES),
        (navigation_limits.DWA, upstream_params.DWA),
        (navigation_limits.COSTMAP, upstream_params.COSTMAP),
    ):
        assert set(names) - set(upstream) - {RESTORE_DEFAULTS} == set()


def test_type_and_limits_are_those_of_the_value():
    assert adjustable('x', 0.5, (0, 2), '')[2:4] == (0.0, 2.0)
    assert adjustable('x', 3, (1, math.inf), '')[2:4] == (1, 2**31 - 1)
    assert adjustable('x', 0.5, None, '')[2:4] == (-math.inf, math.inf)
    assert [adjustable('x', value, None, '').type_name for value in (True, 1, 1.0, 'a')] == [
        'bool',
        'int',
        'double',
        'str',
    ]
    for value in (0.5, 3):
        assert {type(one) for one in adjustable('x', value, (0, 2), '')[1:4]} == {type(value)}


def test_a_value_beyond_the_limits_widens_them():
    """Upstream clamps it at the start, and so changes what it is not asked to."""
    assert adjustable('max_particles', 20000, (1, 10000), '')[1:4] == (20000, 1, 20000)


@pytest.mark.parametrize(('params', 'limits'), GROUPS)
def test_every_parameter_has_its_meaning_and_a_value_that_may_be_set_again(params, limits):
    for one in adjustables_of(params, limits):
        assert one.description
        assert one.choices == () or one.value in one.choices
        assert with_changes(params, {one.name: one.value}, '') == params


@pytest.mark.parametrize(('params', 'limits'), GROUPS)
def test_what_is_within_the_limits_is_taken_or_refused_in_one_line(params, limits):
    for one in adjustables_of(params, limits):
        for value in (one.least, one.most):
            try:
                with_changes(params, {one.name: value}, '')
            except ConfigError as error:
                assert one.name in str(error) or 'allowed' in str(error)
                assert '\n' not in str(error)
