"""Parameters of a node, its log, its threads, its services, and pauses between two looks at /clock."""

import contextlib
import logging
import threading
import time
from types import SimpleNamespace

import pytest
import rospy
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty

from diff_encoder_sim.base.errors import EVENT, ConfigError
from diff_encoder_sim.ros import node
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

LONG_S = 20.0

# ---- parameters


@pytest.fixture(name='given')
def fixture_given(monkeypatch):
    """Sets the private parameters of /node, a robot's settings, and its command line; returns the parameter server."""
    parameters = {}

    def given(private, of_robot=None, typed=()):
        parameters.update({'~': private, '/robot_settings/config': of_robot or {}})
        monkeypatch.setattr(rospy, 'get_param', parameters.get)
        monkeypatch.setattr(rospy, 'set_param', parameters.__setitem__)
        monkeypatch.setattr(rospy, 'get_name', lambda: '/node')
        monkeypatch.setattr(node.sys, 'argv', ['node', *typed])
        return parameters

    return given


def test_parameters_of_other_nodes_in_the_same_file_are_no_misspellings(given):
    given({'rate': 10.0, 'wheel_diameter': 0.3})
    assert node.node_params(EncoderParams, OdometryParams).rate == 10.0
    assert node.node_params(OdometryParams, EncoderParams).wheel_diameter.plain == 0.3
    given({'wheel_diameter': 0.3})
    with pytest.raises(ConfigError, match=r'^/node: wheel_diameter: '):
        node.node_params(EncoderParams)


def test_a_robots_settings_override_yaml_files_and_what_is_typed_overrides_both(given):
    given({'rate': 10.0, 'ppr': 40}, {'rate': 30.0, 'ppr': 4096}, ['_ppr:=40', '__name:=node'])
    params = node.node_params(EncoderParams, part='config', defaults={'rate': 5.0, 'seed': 7})
    assert (params.rate, params.ppr.left, params.seed) == (30.0, 40, 7)
    given({}, {'rate': -1.0})
    with pytest.raises(ConfigError, match=r'^/node with /robot_settings/config: rate: given -1.0'):
        node.node_params(EncoderParams, part='config')


@pytest.mark.parametrize(
    ('private', 'of_robot', 'ppr'),
    [
        ({'ppr': 90}, {'ppr': 40}, 40),
        ({}, {}, 90),
        ({'ppr': '{left: 90, right: 1024}'}, {}, {'left': 90, 'right': 1024}),  # a launch argument
        ({'ppr': 90}, {'ppr': {'left': 508.8, 'right': 508.8}}, 508.8),
        ({'ppr': 90}, {'encoder': {'lines': 2048}}, 8192),
    ],
)
def test_the_values_in_use_are_written_to_the_private_parameters(given, private, of_robot, ppr):
    server = given({**private, 'velocity_window': 3}, {**of_robot, 'counter_modulus': '4294967296'})
    params = node.node_params(EncoderParams, OdometryParams, part='config')
    assert params.counter_modulus == 2**32  # more than 32 bits come as text
    written = server['~']
    assert (written['ppr'], written['counter_modulus'], written['velocity_window']) == (ppr, '4294967296', 3)
    assert (written['rate'], written['encoder']['noise']) == (20.0, 0.0)  # the defaults
    assert 'wheel_diameter' not in written  # of the other struct, and not given
    node.node_params(OdometryParams, EncoderParams, part='config')
    assert {**server['~'], **written} == server['~']
    assert server['~']['motion_noise'] == 1e-6  # which follows from other values


# ---- the log, threads, topics and services


def test_a_message_about_a_topic_is_repeated_only_after_a_while_and_events_always(monkeypatch):
    texts, clock, log = [], [0.0], logging.Logger('test_node', logging.INFO)  # noqa: LOG001
    send = dict.fromkeys((logging.INFO, logging.WARNING), lambda _, text: texts.append(text))
    monkeypatch.setattr(node, '_SEND', send)
    monkeypatch.setattr(node.time, 'monotonic', lambda: clock[0])
    log.addHandler(node._RosLogHandler())
    for at_s, topic, age_s in ((0, '/scan', 1), (1, '/scan', 2), (4.9, '/odom', 3), (5, '/scan', 4)):
        clock[0] = at_s
        log.warning('%s: %d s old', topic, age_s)
    for _ in range(2):
        log.info('restarted', extra=EVENT)
    assert texts == ['/scan: 1 s old', '/odom: 3 s old', '/scan: 4 s old', 'restarted', 'restarted']


@pytest.mark.parametrize('is_of_this_package', [True, False])
def test_a_thread_that_ends_by_an_exception_ends_the_node(monkeypatch, is_of_this_package):
    """Only one of this package: rospy's own threads may end so when another node dies."""
    reasons = []

    def broken():
        raise RuntimeError('a map that nobody thought of')

    def build():
        thread = threading.Thread(target=(lambda: node.compile_first(broken)) if is_of_this_package else broken)
        thread.start()
        thread.join()

    monkeypatch.setattr(rospy, 'init_node', lambda name: None)
    monkeypatch.setattr(rospy, 'signal_shutdown', reasons.append)
    monkeypatch.setattr(node, 'log', logging.Logger('test_node_ends'))  # noqa: LOG001
    monkeypatch.setattr(threading, 'excepthook', threading.excepthook)
    with pytest.raises(SystemExit) if is_of_this_package else contextlib.nullcontext():
        node.executable('node', build, lambda _: None)()
    assert len(reasons) == is_of_this_package


def test_a_service_call_ends_whatever_the_service_does(monkeypatch):
    released = threading.Event()

    def fail():
        raise rospy.ServiceException('service [/service] unavailable')

    for handler, text in ((lambda: released.wait(30.0), 'no response'), (fail, 'unavailable')):
        monkeypatch.setattr(rospy, 'ServiceProxy', lambda service, service_class: handler)
        with pytest.raises(rospy.ServiceException, match=text):
            node.call_service('service', Empty, limit_s=0.05)
    released.set()
    monkeypatch.setattr(rospy, 'ServiceProxy', lambda service, service_class: lambda request: f'response to {request}')
    assert node.call_service('service', Empty, 'request') == 'response to request'


# ---- connections

PUBLISHERS = [['/odom', ['/odometry']], ['/scan', ['/simulator']], ['/tf', ['/odometry', '/amcl']]]
SUBSCRIBERS = [['/odom', ['/move_base', '/recorder']], ['/tf', ['/move_base']], ['/cmd_vel', ['/simulator']]]

# The nodes' outbound connections: (topic, subscribing node).
ALL = {
    '/odometry': {('/odom', '/move_base'), ('/odom', '/recorder'), ('/tf', '/move_base')},
    '/amcl': {('/tf', '/move_base')},
    '/simulator': set(),
}


@pytest.fixture(name='unconnected')
def fixture_unconnected(monkeypatch):
    master = SimpleNamespace(getSystemState=lambda: (PUBLISHERS, SUBSCRIBERS, []), lookupNode=lambda name: name)
    monkeypatch.setattr(node.rosgraph, 'Master', lambda _: master)

    def unconnected(links, topics, if_published=()):
        monkeypatch.setattr(node, '_links_of', lambda uri: links[uri])
        return node.unconnected(topics, if_published)

    return unconnected


def test_a_topic_is_connected_when_each_subscriber_is_to_each_publisher(unconnected):
    assert unconnected(ALL, ['/odom', '/tf', '/scan']) == []
    assert unconnected({**ALL, '/amcl': set()}, ['/odom', '/tf']) == ['/tf']
    assert unconnected({**ALL, '/odometry': {('/odom', '/move_base')}}, ['/odom']) == ['/odom']


def test_a_topic_needs_a_publisher_unless_it_may_be_absent(unconnected):
    assert unconnected(ALL, ['/cmd_vel']) == ['/cmd_vel']
    assert unconnected(ALL, [], ['/cmd_vel', '/odom']) == []


# ---- callbacks and the clock


def test_after_each_tick_the_thread_pauses_until_a_look_is_wanted_or_every_tick_is(monkeypatch):
    for name, value in (('_is_wanted', threading.Event()), ('_listeners', []), ('PAUSE_S', LONG_S)):
        monkeypatch.setattr(node, name, value)
    for end_pause in (node.look_at_clock, node.read_every_tick):
        thread = threading.Thread(target=node._on_clock, args=(Clock(),), daemon=True)
        thread.start()
        thread.join(0.05)
        assert thread.is_alive()
        end_pause()
        thread.join(LONG_S / 2)
        assert not thread.is_alive()
    heard, begun_s = [], time.monotonic()
    node.read_every_tick(heard.append)
    node._on_clock(Clock())
    assert len(heard) == 1 and time.monotonic() - begun_s < LONG_S / 2


def test_callbacks_run_one_at_a_time_and_after_the_constructor(monkeypatch):
    """Each connection calls back in a thread of its own: an older transform must not be used after a newer one."""
    events, threads = [], []

    def callback(name):
        events.append(f'begin {name}')
        time.sleep(0.01)
        events.append(f'end {name}')

    def build():
        for name in 'ab':
            threads.append(threading.Thread(target=node.one_at_a_time(callback), args=(name,)))
            threads[-1].start()
        time.sleep(0.01)
        events.append('built')

    monkeypatch.setattr(rospy, 'init_node', lambda name: None)
    monkeypatch.setattr(threading, 'excepthook', threading.excepthook)
    monkeypatch.setattr(node, 'log', logging.Logger('test_node_builds'))  # noqa: LOG001
    node.executable('node', build, lambda _: [thread.join() for thread in threads])()
    assert events[0] == 'built'
    assert [one.split()[1] for one in events[1::2]] == [one.split()[1] for one in events[2::2]]
