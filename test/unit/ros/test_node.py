"""Parameters of a node, and how often its log repeats a message."""

import contextlib
import logging
import threading

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

import rospy
from std_msgs.msg import Header

from diff_encoder_sim.base.errors import EVENT, ConfigError
from diff_encoder_sim.ros import node
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


@pytest.fixture(name='given')
def fixture_given(monkeypatch):
    """Sets the private parameters of a node called /node, a robot's settings, and what is typed on its command line.

    Returns the parameter server; a test may change the private parameters that a node has written.
    """
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
    assert node.node_params(OdometryParams, EncoderParams).wheel_diameter == 0.3
    with pytest.raises(ConfigError, match=r'^/node: wheel_diameter: unknown key'):
        node.node_params(EncoderParams)


def test_a_launch_argument_with_a_value_for_each_wheel_is_text(given):
    given({'ppr': '{left: 90, right: 1024}'})
    ppr = node.node_params(EncoderParams).ppr
    assert (ppr.left, ppr.right) == (90, 1024)


def test_a_robots_settings_go_before_yaml_files_and_what_is_typed_before_them(given):
    given({'rate': 10.0, 'ppr': 40}, {'rate': 30.0, 'ppr': 4096}, ['_ppr:=40', '__name:=node'])
    params = node.node_params(EncoderParams, part='config')
    assert (params.rate, params.ppr.left) == (30.0, 40)
    assert node.node_params(EncoderParams).rate == 10.0  # a node that has no part of them


def test_a_number_of_more_than_32_bits_comes_as_text(given):
    given({}, {'counter_modulus': '4294967296', 'left_joint': '7'})
    params = node.node_params(EncoderParams, part='config')
    assert (params.counter_modulus, params.left_joint) == (2**32, '7')


def test_a_bad_value_among_a_robots_settings_is_named_with_them(given):
    given({}, {'rate': -1.0})
    with pytest.raises(ConfigError, match=r'^/node with /robot_settings/config: rate: given -1.0'):
        node.node_params(EncoderParams, part='config')


@pytest.mark.parametrize(
    ('private', 'of_robot', 'ppr'),
    [
        ({'ppr': 90}, {'ppr': 40}, 40),
        ({}, {}, 90),
        ({'ppr': '{left: 90, right: 1024}'}, {}, {'left': 90, 'right': 1024}),
        ({'ppr': 90}, {'ppr': {'left': 508.8, 'right': 508.8}}, 508.8),
        ({'ppr': 90}, {'encoder': {'lines': 2048}}, 8192),
    ],
)
def test_the_values_in_use_are_written_to_the_private_parameters(given, private, of_robot, ppr):
    server = given({**private, 'velocity_window': 3}, {**of_robot, 'counter_modulus': '4294967296'})
    node.node_params(EncoderParams, OdometryParams, part='config')
    written = server['~']
    assert (written['ppr'], written['counter_modulus'], written['velocity_window']) == (ppr, '4294967296', 3)
    assert (written['rate'], written['encoder']['noise']) == (20.0, 0.0)  # the defaults
    assert 'wheel_diameter' not in written  # of the other struct, and not given
    node.node_params(OdometryParams, EncoderParams, part='config')
    assert {**server['~'], **written} == server['~']
    assert server['~']['motion_noise'] == 1e-6  # which follows from other values


def test_values_that_a_node_has_written_are_not_given_ones_at_its_next_start(given):
    server = given({'ppr': 90}, {'ppr': 40}, ['_rate:=20.0'])
    node.node_params(EncoderParams, defaults={'seed': 7}, part='config')
    assert (server['~']['ppr'], server['~']['seed']) == (40, 7)
    given(server['~'], {'report': {'latency': 0.03}})
    params = node.node_params(EncoderParams, defaults={'seed': 8}, part='config')
    assert (params.ppr.left, params.seed, params.report.latency) == (90, 8, 0.03)
    given(server['~'])
    assert node.node_params(EncoderParams).report.latency == 0.0
    assert server['~']['report']['latency'] == 0.0


def test_values_that_a_user_sets_after_the_start_are_given_ones_at_the_next(given):
    server = given({'ppr': 90}, {'ppr': 40})
    node.node_params(EncoderParams, part='config')
    given({**server['~'], 'rate': 50.0, 'report': {**server['~']['report'], 'latency': 0.03}})
    params = node.node_params(EncoderParams, defaults={'rate': 10.0})
    assert (params.ppr.left, params.rate, params.report.latency) == (90, 50.0, 0.03)
    given({**server['~'], 'ppr': 8}, {'ppr': 1024}, ['_ppr:=8'])
    assert node.node_params(EncoderParams, part='config').ppr.left == 8


def test_parameters_that_a_launch_file_has_cleared_and_set_again_are_given_ones(given):
    """With the values that the node had written."""
    server = given({}, {'ppr': 40})
    node.node_params(EncoderParams, part='config')
    given({'ppr': 40, 'rate': server['~']['rate']})
    assert node.node_params(EncoderParams, defaults={'rate': 10.0}).ppr.left == 40
    assert server['~']['rate'] == 20.0


@pytest.fixture(name='sent')
def fixture_sent(monkeypatch):
    """What reaches /rosout, at a clock that the test sets: (lines, clock)."""
    lines, clock = [], [0.0]
    levels = ((logging.WARNING, lambda _, text: lines.append(text)), (logging.INFO, lambda _, text: lines.append(text)))
    monkeypatch.setattr(node._RosLogHandler, '_LEVELS', levels)
    monkeypatch.setattr(node.time, 'monotonic', lambda: clock[0])
    return lines, clock


@pytest.fixture(name='log')
def fixture_log(sent):
    log, handler = logging.getLogger('test_node'), node._RosLogHandler()
    log.setLevel(logging.INFO)
    log.addHandler(handler)
    yield log
    log.removeHandler(handler)


def test_a_message_is_repeated_only_after_a_while(sent, log):
    lines, clock = sent
    for at_s, age_s in ((0.0, 1), (1.0, 2), (4.9, 3), (5.0, 4)):
        clock[0] = at_s
        log.warning('%s: %d s old', '/scan', age_s)
    assert lines == ['/scan: 1 s old', '/scan: 4 s old']


def test_the_same_message_about_another_topic_is_another_one(sent, log):
    for topic in ('/scan', '/odom', '/scan'):
        log.warning('%s: dropped', topic)
    assert sent[0] == ['/scan: dropped', '/odom: dropped']


def test_events_are_always_sent(sent, log):
    for _ in range(3):
        log.info('restarted', extra=EVENT)
    assert sent[0] == ['restarted'] * 3


@pytest.mark.parametrize('is_shut_down', [True, False])
def test_a_message_that_comes_while_the_node_ends_is_no_traceback(monkeypatch, is_shut_down):
    publisher = node.publisher('/nowhere', Header)
    publisher.unregister()
    monkeypatch.setattr(rospy.core, 'is_shutdown_requested', lambda: is_shut_down)
    with contextlib.nullcontext() if is_shut_down else pytest.raises(rospy.ROSException):
        publisher.publish(Header())


@pytest.mark.parametrize('is_of_this_package', [True, False])
def test_a_thread_that_ends_by_an_exception_ends_the_node(monkeypatch, is_of_this_package):
    """Only one of this package: rospy's own threads may end so when another node dies."""
    reasons, ended = [], threading.Event()

    def broken(*_):
        ended.set()
        raise RuntimeError('a map that nobody thought of')

    def build():
        target = (lambda: node.compile_first(broken)) if is_of_this_package else broken
        thread = threading.Thread(target=target)
        thread.start()
        thread.join()

    monkeypatch.setattr(rospy, 'init_node', lambda name, argv: None)
    monkeypatch.setattr(rospy, 'signal_shutdown', reasons.append)
    monkeypatch.setattr(node, 'log', logging.getLogger('test_node_ends'))  # which gets a handler
    monkeypatch.setattr(threading, 'excepthook', threading.excepthook)
    monkeypatch.setattr(node, '_print_traceback', lambda _: None)
    with pytest.raises(SystemExit) if is_of_this_package else contextlib.nullcontext():
        node.run_node('node', build, lambda _: None)
    assert ended.is_set()
    assert len(reasons) == is_of_this_package
