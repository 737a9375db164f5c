"""Parameters of the navigator: upstream's tree, and what is refused."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import split_params
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from navigation_simulation import TABLE_2
from upstream_params import upstream_navigation


def test_unknown_parameters_are_named():
    with pytest.raises(ConfigError, match='max_vel_z: unknown key'):
        NavigatorParams.from_mapping({'DWAPlannerROS': {'max_vel_z': 1.0}}, 'navigation.yaml')


def test_a_robot_that_could_never_start_is_a_config_error():
    """0.7 m/s^2 in 50 ms is 0.035 m/s: below upstream's default min_vel_trans of 0.1."""
    with pytest.raises(ConfigError, match='min_vel_trans'):
        NavigatorParams.from_mapping(
            {'DWAPlannerROS': {**TABLE_2, 'min_vel_trans': 0.1, 'min_vel_theta': 0.4}}, 'x.yaml'
        )
    NavigatorParams()  # upstream's own defaults can


def test_the_navigator_takes_every_parameter_of_upstream_at_its_default():
    (params,) = split_params(upstream_navigation(), 'move_base', NavigatorParams)  # as the node does
    assert params.global_costmap.static_map and not params.local_costmap.static_map
    assert params.DWAPlannerROS.goal_distance_bias == 0.8
    for costmap in (params.global_costmap, params.local_costmap):
        assert (costmap.obstacle_range, costmap.raytrace_range) == (2.5, 3.0)
        assert costmap.transform_tolerance == 0.3  # not the obstacle layer's
        assert not costmap.scan.clearing  # as upstream: clearing is off by default
        assert not costmap.track_unknown_space  # the costmap's counts before a layer's


@pytest.mark.parametrize(
    ('given', 'complaint'),
    [
        (
            {'base_local_planner': 'teb_local_planner/TebLocalPlannerROS'},
            (
                "base_local_planner: given 'teb_local_planner/TebLocalPlannerROS'; allowed: "
                "'dwa_local_planner/DWAPlannerROS'"
            ),
        ),
        ({'base_global_planner': 'global_planner/GlobalPlanner'}, "allowed: 'navfn/NavfnROS'"),
        # Upstream's default is map: the robot would take its odometry for where it is on the map.
        ({'local_costmap': {'rolling_window': True}}, "local_costmap.global_frame that is /odom's"),
        ({'local_costmap': {'rolling_window': True, 'global_frame': '/map'}}, 'and not global_costmap'),
    ],
)
def test_what_the_navigator_cannot_do_is_named_in_one_line(given, complaint):
    with pytest.raises(ConfigError) as caught:
        NavigatorParams.from_mapping(given, '/move_base')
    assert complaint in str(caught.value) and '\n' not in str(caught.value)


@pytest.mark.parametrize(
    ('listed', 'complaint'),
    [
        ([{'name': 'a', 'type': 'move_slow_and_clear/MoveSlowAndClear'}], 'MoveSlowAndClear'),
        ([{'name': 'a'}], 'type'),
        ([{'type': 'rotate_recovery/RotateRecovery'}], 'name'),
        (2 * [{'name': 'a', 'type': 'rotate_recovery/RotateRecovery'}], 'a name of its own'),
    ],
)
def test_recovery_behaviours_that_there_are_not(listed, complaint):
    with pytest.raises(ConfigError, match='recovery_behaviors') as caught:
        NavigatorParams.from_mapping(upstream_navigation(recovery_behaviors=listed), '')
    assert complaint in str(caught.value)


@pytest.mark.parametrize(
    ('given', 'latches'),
    [
        ({'latch_xy_goal_tolerance': True}, True),
        ({'DWAPlannerROS': {'latch_xy_goal_tolerance': True}}, True),
        ({'latch_xy_goal_tolerance': False, 'DWAPlannerROS': {'latch_xy_goal_tolerance': True}}, False),
    ],
)
def test_the_latch_is_read_where_upstream_reads_it(given, latches):
    params = NavigatorParams.from_mapping(given, '')
    assert params.DWAPlannerROS.latch_xy_goal_tolerance == latches
