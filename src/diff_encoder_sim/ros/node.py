"""Common functions of nodes: start and end, parameters, callbacks, services, connections, log, clock."""

from __future__ import annotations

import concurrent.futures
import logging
import math
import os
import sys
import threading
import time
import traceback
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterable, List, Mapping, Optional, Set, Tuple, Type

import rosgraph
import rospy
import rospy.client
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty, EmptyResponse

from diff_encoder_sim.base.errors import ConfigError, readable
from diff_encoder_sim.base.params import P, Params, for_xml_rpc, from_xml_rpc, merged, shared_params
from diff_encoder_sim.base.yaml_files import yaml_value

if TYPE_CHECKING:
    from diff_encoder_sim.drives.trial_definition import LivePlan

CONSOLE_FORMAT = '[${severity}] [${time}] [${node}]: ${message}'  # the default of rospy has no node name
log = logging.getLogger('diff_encoder_sim')

# rospy uses threads for each topic, service and timer. The callbacks of a node hold this lock, as does its constructor.
CALLBACKS = threading.RLock()


def executable(
    name: str, build: Callable[..., Any], run: Callable[[Any], None] = lambda node: rospy.spin()
) -> Callable[..., None]:
    """Return the main function of a node: it builds an object, and lets it `run`, by default until shutdown.

    Invalid input, and an exception in a thread of this package, end the node with one line and exit status 1.
    """

    def main(*arguments: Any) -> None:
        broken_threads: List[str] = []
        threading.excepthook = lambda args: _end_with_thread(args, broken_threads)
        os.environ.setdefault('ROSCONSOLE_FORMAT', CONSOLE_FORMAT)
        try:
            rospy.init_node(name)
            if not rospy.rostime.is_wallclock():
                rospy.Subscriber('/clock', Clock, _on_clock, tcp_nodelay=True)  # rospy's connection, its queue of one
            log.setLevel(logging.INFO)
            log.addHandler(_RosLogHandler())
            log.propagate = False
            with CALLBACKS:
                node = build(*arguments)
            run(node)
            if broken_threads:
                sys.exit(1)
        except ConfigError as error:
            rospy.logfatal('%s', error)
            sys.exit(1)
        except OSError as error:
            if error.filename is None:
                raise
            rospy.logfatal('%s', readable(f'{error.filename}: {error.strerror}'))
            sys.exit(1)
        except (rospy.ROSInterruptException, rospy.exceptions.ROSInitException):
            log.info('stopped before it was running')  # by Ctrl-C or roslaunch

    main.__doc__ = f'{name}: {build.__doc__}'
    return main


def _end_with_thread(args: threading.ExceptHookArgs, broken_threads: List[str]) -> None:
    if is_ending():
        return
    traceback.print_exception(args.exc_type, args.exc_value, args.exc_traceback)
    modules = (frame.f_globals.get('__name__', '') for frame, _ in traceback.walk_tb(args.exc_traceback))
    # Threads of rospy may end like this when another node dies.
    if any(module.startswith('diff_encoder_sim.') for module in modules):
        broken_threads.append(args.thread.name if args.thread else '')
        rospy.logfatal('internal error: %s: %s; the node ends', args.exc_type.__name__, args.exc_value)
        rospy.signal_shutdown('a thread has ended by an exception')


def is_ending() -> bool:
    """Return whether the node's shutdown has begun: topics are closed before rospy.is_shutdown() is true."""
    return bool(rospy.core.is_shutdown_requested())


def own_words() -> List[str]:
    """Return the command-line words, without the remappings of roslaunch."""
    return [word for word in sys.argv[1:] if ':=' not in word]


def compile_first(warm_up: Callable[[], None]) -> None:
    """Compile the numba kernels of a node before it subscribes, to avoid message loss."""
    start_s = time.monotonic()
    warm_up()
    took_s = time.monotonic() - start_s
    if took_s > 1.0:
        log.info('numba has compiled this node in %.1f s; cached for the next start', took_s)


ROBOT_SETTINGS = '/robot_settings'  # set by launch files with the command of this name


def node_params(
    params_class: Type[P], *also_known: Type[Params], part: str = '', defaults: Optional[Mapping[str, Any]] = None
) -> P:
    """Read the node's private parameters, and write the values in use to them; launch files clear them at a start.

    Keys of `also_known`, structs of nodes that share the YAML file, are allowed, others raise ConfigError. The values
    of a `part` of /robot_settings replace those of YAML files and launch files.
    """
    name, private = rospy.get_name(), rospy.get_param('~', {})
    of_robot = robot_settings(part) if part else {}
    typed = rospy.client.load_command_line_node_params(sys.argv)  # as `_ppr:=90`
    given = merged({**(defaults or {}), **private}, of_robot)
    given.update((key, private[key]) for key in typed if key in private)
    for key, value in given.items():
        # A launch argument such as `{left: 90, right: 1024}`, and numbers of more than 32 bits, are text.
        is_mapping = isinstance(value, str) and value.startswith('{')
        given[key] = yaml_value(value, f'{name}: {key}') if is_mapping else from_xml_rpc(value)
    source = f'{name} with {ROBOT_SETTINGS}/{part}' if of_robot else name
    params = shared_params(given, source, params_class, *also_known)
    rospy.set_param('~', for_xml_rpc({**private, **given, **params.values_in_use()}))
    return params


def robot_settings(part: str) -> Dict[str, Any]:
    """Return a part of the robot's settings, which launch files set; {} without a robot."""
    return dict(rospy.get_param(f'{ROBOT_SETTINGS}/{part}', {}))


def trial_plan() -> Optional[LivePlan]:
    """Return the plan of the running trial, None without a trial; ConfigError if /trial is not a plan."""
    plan = rospy.get_param('/trial', None)
    if plan is None:
        return None
    from diff_encoder_sim.drives.trial_definition import LivePlan  # noqa: PLC0415  # slow, and needed only in a trial

    return LivePlan.from_mapping(from_xml_rpc(plan), '/trial')


def required_trial_plan() -> LivePlan:
    """Return `trial_plan`; ConfigError if there is none."""
    plan = trial_plan()
    if plan is None:
        raise ConfigError('/trial: missing; expected the parameter that trial.launch sets, which starts this node')
    return plan


def one_at_a_time(callback: Callable[..., Any]) -> Callable[..., Any]:
    """Return a callback that waits for the other ones of the node, and for its constructor."""

    def call(*args: Any) -> Any:
        with CALLBACKS:
            return callback(*args)

    return call


def service(name: str, service_class: Any, respond: Callable[[Any], Any]) -> rospy.Service:
    """Serve requests."""
    return rospy.Service(name, service_class, one_at_a_time(respond))


def empty_service(name: str, act: Callable[[], None]) -> rospy.Service:
    """Serve a request without arguments (std_srvs/Empty)."""

    def respond(_: Any) -> EmptyResponse:
        act()
        return EmptyResponse()

    return service(name, Empty, respond)


def timer(period_s: float, act: Callable[[], None]) -> rospy.Timer:
    """Call `act` in each period, also after a reset of time."""
    return rospy.Timer(rospy.Duration(period_s), one_at_a_time(lambda _: act()), reset=True)


MAP_LIMIT_S = 30.0  # for services that return a map


def call_service(service: str, service_class: Any, *request: Any, limit_s: float = 5.0) -> Any:
    """Call a service in a thread, because a suspended node never responds; ServiceException after `limit_s` at most."""
    response: concurrent.futures.Future[Any] = concurrent.futures.Future()

    def call() -> None:
        try:
            response.set_result(rospy.ServiceProxy(service, service_class)(*request))
        except Exception as error:
            response.set_exception(error)

    threading.Thread(target=call, daemon=True).start()
    try:
        return response.result(limit_s)
    except concurrent.futures.TimeoutError:
        raise rospy.ServiceException(f'no response within {limit_s:g} s') from None


POLL_PERIOD_S = 0.1


def unconnected(topics: Iterable[str], if_published: Iterable[str] = ()) -> List[str]:
    """Return the topics with an unconnected subscriber, and those of `topics` without a publisher."""
    master = rosgraph.Master(rospy.get_name())
    publishers, subscribers = map(dict, master.getSystemState()[:2])
    wanted = [*topics, *(topic for topic in if_published if topic in publishers)]
    nodes = {node for topic in wanted for node in publishers.get(topic, [])}
    links = {node: _links_of(master.lookupNode(node)) for node in nodes}

    def is_connected(topic: str) -> bool:
        pairs = {(topic, subscriber) for subscriber in subscribers.get(topic, [])}
        return topic in publishers and all(pairs <= links[node] for node in publishers[topic])

    return [topic for topic in wanted if not is_connected(topic)]


def _links_of(node_uri: str) -> Set[Tuple[str, str]]:
    """Return (topic, subscribing node) of each connection of a node's publishers."""
    # [code, text, connections of id, destination, direction, transport, topic, connected, ...]
    connections = rospy.core.xmlrpcapi(node_uri).getBusInfo(rospy.get_name())[2]
    return {(connection[4], connection[1]) for connection in connections if connection[2] == 'o' and connection[5]}


def wait_until_connected(topics: Iterable[str], if_published: Iterable[str], timeout_s: float) -> List[str]:
    """Wait until no topic is `unconnected`; return the unconnected topics at the timeout (wall time)."""
    deadline_s = time.monotonic() + timeout_s
    while True:
        try:
            missing = unconnected(topics, if_published)
        except (OSError, rosgraph.MasterException) as error:  # a node that is starting or ending
            missing = [str(error)]
        if not missing or time.monotonic() > deadline_s or rospy.is_shutdown():
            return missing
        time.sleep(POLL_PERIOD_S)


LOG_AGAIN_AFTER_S = 5.0
_SEND = {logging.ERROR: rospy.logerr, logging.WARNING: rospy.logwarn, logging.INFO: rospy.loginfo}


class _RosLogHandler(logging.Handler):
    """Sends the log of the core to /rosout, without repeats within LOG_AGAIN_AFTER_S of wall time, except of events."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self._last_s: Dict[Tuple[str, str], float] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Send a record unless it is a repeat."""
        # Messages that differ only in numbers are repeats; those about different topics are not.
        topic = next((value for value in record.args or () if isinstance(value, str)), '')
        key, now_s = (str(record.msg), topic), time.monotonic()
        if getattr(record, 'event', False) or now_s - self._last_s.get(key, -math.inf) >= LOG_AGAIN_AFTER_S:
            self._last_s[key] = now_s
            _SEND[record.levelno]('%s', record.getMessage())


# rospy reads each tick of /clock in a thread of each node: a third of the graph's load at rtf:=0. With pauses the ticks
# wait in the socket, and only the latest is used: the clock is late by at most PAUSE_S of wall time.
PAUSE_S = 0.02

_listeners: List[Callable[[Clock], None]] = []
_is_wanted = threading.Event()


def read_every_tick(listener: Callable[[Clock], None] = lambda _: None) -> None:
    """Disable pauses, and call back with each tick."""
    _listeners.append(one_at_a_time(listener))
    look_at_clock()


def look_at_clock() -> None:
    """End the current pause."""
    _is_wanted.set()


def _on_clock(message: Clock) -> None:
    _is_wanted.clear()
    for listener in _listeners:
        listener(message)
    if not _listeners:
        _is_wanted.wait(PAUSE_S)
