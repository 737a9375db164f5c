"""config/navigation.yaml against the parameters that upstream's navigation has, both ways."""

from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from upstream_params import (
    COSTMAP,
    DWA,
    FLAT,
    FLAT_NAMES,
    MOVE_BASE,
    MOVE_BASE_NAMES,
    NAVFN,
    SCAN_SOURCE,
    different,
    read_config,
    wrong_types,
)

# Parameters that upstream does not have and ignores.
OWN_MOVE_BASE = {'input_timeout', 'max_unseen_travel'}
# Upstream reads them in the layers' namespaces alone; its defaults are the same.
IN_LAYERS = {'combination_method', 'footprint_clearing_enabled', 'trinary_costmap', 'unknown_cost_value'}
OWN_NAVFN = {'use_dijkstra', 'neutral_cost', 'cost_factor'}  # global_planner's
OWN_DWA = {'twist_sigmas', 'latch_margin', 'stop', 'turn_to_path_angle'}


def test_upstream_knows_every_parameter_of_our_navigation_yaml():
    ours = read_config('navigation.yaml')
    parts = {'global_costmap', 'local_costmap', 'NavfnROS', 'DWAPlannerROS'}
    assert set(ours) - MOVE_BASE_NAMES - parts <= OWN_MOVE_BASE
    assert set(ours['DWAPlannerROS']) - set(DWA) <= OWN_DWA
    assert set(ours['NavfnROS']) - set(NAVFN) <= OWN_NAVFN
    for costmap in (ours['global_costmap'], ours['local_costmap']):
        assert set(costmap) <= set(COSTMAP) | FLAT_NAMES | IN_LAYERS
        assert set(costmap['scan']) <= set(SCAN_SOURCE)


def test_values_have_the_type_that_upstream_reads():
    assert wrong_types(read_config('navigation.yaml'), (MOVE_BASE, DWA, COSTMAP, SCAN_SOURCE, FLAT)) == []


def test_what_our_file_leaves_out_is_the_same_in_both_stacks():
    """A default that differs must stand in the file."""
    ours = read_config('navigation.yaml')
    params = NavigatorParams.from_mapping({}, '')
    assert different(MOVE_BASE, params, ours) == set()
    assert different(NAVFN, params.NavfnROS, ours['NavfnROS']) == set()
    assert different(DWA, params.DWAPlannerROS, ours['DWAPlannerROS']) == set()
    # The size of the global one is the map's.
    for name, costmap, other in (
        ('global_costmap', CostmapParams(), {'width', 'height'}),
        ('local_costmap', params.local_costmap, set()),
    ):
        upstream = {**COSTMAP, **FLAT, 'static_map': False}
        assert different(upstream, costmap, ours[name]) <= other
        assert different(SCAN_SOURCE, costmap.scan, ours[name]['scan']) <= {'obstacle_range', 'raytrace_range'}


def test_our_file_means_the_same_to_the_embedded_stack():
    params = NavigatorParams.from_mapping(read_config('navigation.yaml'), 'navigation.yaml')
    assert params.DWAPlannerROS.latch_xy_goal_tolerance
    assert params.global_costmap.observation_sources == 'scan'
    assert params.local_costmap.scan.clearing
