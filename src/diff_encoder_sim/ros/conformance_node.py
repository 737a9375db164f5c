"""conformance_node: judge an odometry node on a ROS graph, by the clauses of the conformance suite.

Publishes the input of the node, listens to its odometry and TF, and restarts or resets it between the cases.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Tuple

import rosgraph
import roslib.message
import rosnode
import rospy
from nav_msgs.msg import Odometry
from rosbags.rosbag1 import Writer
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.command_line import tool_parser
from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.package_files import package_folder, users_path
from diff_encoder_sim.base.params import for_xml_rpc, load_params
from diff_encoder_sim.conformance import report
from diff_encoder_sim.conformance.cases import plan
from diff_encoder_sim.conformance.clauses import Evidence
from diff_encoder_sim.conformance.mapping import NodeMapping, Settings, Wheels, parameters_of
from diff_encoder_sim.conformance.playing import Player, Received, Unusable, play_all
from diff_encoder_sim.conformance.recording import Recording, Sample
from diff_encoder_sim.conformance.verdicts import FAIL, judge
from diff_encoder_sim.drives.field_wheels import split_address, steps_of
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.messages import stamp_from_ns
from diff_encoder_sim.ros.node import call_service, executable, own_words

ODOMETRY = 'nav_msgs/Odometry'
OURS = ('encoder_odometry', 'gz_diff_odom_node')  # mapping files of a running node, the first that fits
MOST_MESSAGES = 500_000  # which fit into memory
USUAL_CASE = 'arc left, 0.5 m'  # for clauses on all cases
STOP_S = 3.0  # from SIGINT to SIGKILL
EXAMPLES = [
    '--node my_node.yaml --out results/',
    '--start false --ppr 1024 --wheel-diameter 0.2 --wheel-separation 0.4',
]


def parse_conformance_node() -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('conformance_node', str(__doc__), EXAMPLES)
    named = ', '.join(sorted(path.stem for path in (package_folder() / 'config' / 'conformance').glob('*.yaml')))
    parser.add_argument('--node', default='', metavar='FILE', help=f'mapping file, or one of {named}')
    started = 'false: judge the node that is running (default: %(default)s)'
    parser.add_argument('--start', choices=['true', 'false'], default='true', help=started)
    for name, field in Wheels.model_fields.items():
        option = f'--{name.replace("_", "-")}'
        parser.add_argument(option, type=float, default=field.default, help=f'{field.description} (%(default)s)')
    parser.add_argument('--counter-modulus', type=int, default=0, help='of a running node; 0: no wrap (%(default)s)')
    noise = "of a running node: stated variance of a wheel's travel [m^2/m]; 0: unknown (%(default)s)"
    parser.add_argument('--motion-noise', type=float, default=0.0, help=noise)
    parser.add_argument('--out', type=Path, default=Path('conformance'), help='folder of the page, JUnit XML and bags')
    parser.add_argument('--gtest_output', default='', metavar='xml:FILE', help='JUnit XML, as rostest calls it')
    return parser.parse_args(own_words())


def find_mapping(options: argparse.Namespace) -> NodeMapping:
    """Return the mapping, without commands for a running node; ConfigError if there is none."""
    folder = package_folder() / 'config' / 'conformance'
    names = [options.node] if options.node else OURS if options.start == 'false' else OURS[:1]
    paths = [folder / f'{name}.yaml' if name.isidentifier() else users_path(name) for name in names]
    found = [load_params(NodeMapping, path) for path in paths]
    if options.start == 'true':
        return found[0]
    subscribed = dict(rosgraph.Master(rospy.get_name()).getSystemState()[1])
    fitting = [each for each in found if {split_address(address)[0] for address in each.input} <= set(subscribed)]
    return (fitting or found)[0].model_copy(update={'command': ''})


class RosSubject:
    """A node on the graph of this process."""

    def __init__(self, mapping: NodeMapping, wheels: Wheels, log_file: Path) -> None:
        self.odometry: List[Received] = []
        self.transforms: List[Received] = []
        self.has_stamps = True
        self._mapping, self._wheels, self._log_file = mapping, wheels, log_file
        self._master = rosgraph.Master(rospy.get_name())
        self._arrived, self._fault, self._pids = threading.Condition(), '', [0]
        self._processes: List[subprocess.Popen[bytes]] = []
        self.publishers: Dict[str, rospy.Publisher] = {}
        self._before = {node: rospy.get_param(node, None) for node in mapping.parameters}
        self._nodes_before = {*rosnode.get_node_names(), rospy.get_name()}
        self.topics = list(dict.fromkeys(split_address(address)[0] for address in mapping.input))
        used = dict(self._master.getSystemState()[0])
        for topic in [*self.topics, *([mapping.odom] if mapping.commands else [])]:
            others = [name for name in used.get(topic, []) if name != rospy.get_name()]
            if others:
                raise ConfigError(f'{topic}: published by {", ".join(others)}; allowed: only by the suite and its node')
        for topic, received in ((mapping.odom, self.odometry), ('/tf', self.transforms)):
            rospy.Subscriber(topic, rospy.AnyMsg, self._on_message, received, queue_size=None, tcp_nodelay=True)

    def _on_message(self, message: Any, received: List[Received]) -> None:
        kind = message._connection_header['type']
        with self._arrived:
            if received is self.odometry and kind != ODOMETRY:
                self._fault = f'{self._mapping.odom}: given {kind}; allowed: {ODOMETRY}'
            else:
                received.append(Received(time.monotonic_ns(), message._buff))
            self._arrived.notify()

    def start(self, settings: Settings) -> None:
        """Start the node, or connect to the running one."""
        self.stop()
        for node, parameters in parameters_of(self._mapping, self._wheels, settings).items():
            if self._mapping.commands:
                rospy.set_param(node, for_xml_rpc(parameters))
        with open(self._log_file, 'ab') as log:
            for command in self._mapping.commands:
                try:
                    words = shlex.split(command)
                    process = subprocess.Popen(words, stdout=log, stderr=log, start_new_session=True)
                except (OSError, ValueError) as error:
                    raise ConfigError(f'command: given {command!r}: {in_one_line(error)}') from None
                self._processes.append(process)
        self._fault = ''
        limit_s = self._mapping.start_timeout
        if not self.wait(lambda: not self._unsubscribed(), limit_s):
            raise Unusable(self.fault() or f'{", ".join(self._unsubscribed())}: no subscriber within {limit_s:g} s')
        types = dict(self._master.getTopicTypes())
        for topic in self.topics:
            message_class = roslib.message.get_message_class(types.get(topic, ''))
            if message_class is None:
                raise Unusable(f'{topic}: given {types.get(topic)}, which is not installed')
            if topic not in self.publishers:
                self.publishers[topic] = rospy.Publisher(topic, message_class, queue_size=1000, tcp_nodelay=True)
            self.has_stamps &= message_class._has_header
        if not self.wait(lambda: all(each.get_num_connections() for each in self.publishers.values()), limit_s):
            raise Unusable(self.fault() or f'{self.topics[0]}: not connected within {limit_s:g} s')
        published, subscribed = map(dict, self._master.getSystemState()[:2])
        nodes = {*published.get(self._mapping.odom, []), *(node for topic in self.topics for node in subscribed[topic])}
        self._pids = [self._process_of(node) for node in nodes]

    def _unsubscribed(self) -> List[str]:
        return sorted({*self.topics} - {*dict(self._master.getSystemState()[1])})

    def _process_of(self, node: str) -> int:
        """Return the process id of a node; 0 if it cannot be read."""
        with contextlib.suppress(Exception):  # XML-RPC raises many types
            return int(rospy.core.xmlrpcapi(self._master.lookupNode(node)).getPid(rospy.get_name())[2])
        return 0

    def messages(self, sample: Sample) -> Iterator[Tuple[str, Any]]:
        """Yield the input by topic."""
        values = sample.quantities(self._wheels)
        built = {topic: publisher.data_class() for topic, publisher in self.publishers.items()}
        for address, given in self._mapping.input.items():
            topic, place_text = split_address(address)
            *steps, last = steps_of(place_text)
            place: Any = built[topic]
            for step in steps:
                place = place[step] if isinstance(step, int) else getattr(place, step)
            if isinstance(last, int):
                place += [0] * (last + 1 - len(place))
                place[last] = values.get(str(given), given)
            else:
                setattr(place, last, values.get(str(given), given))
        for topic, message in built.items():
            if message._has_header:
                message.header.stamp = stamp_from_ns(sample.stamp_ns)
            yield topic, message

    def send(self, sample: Sample) -> None:
        """Publish the input."""
        try:
            for topic, message in self.messages(sample):
                self.publishers[topic].publish(message)
        except (AttributeError, IndexError, TypeError, rospy.ROSSerializationException) as error:
            raise ConfigError(f'input: {in_one_line(error)}') from None

    def wait(self, is_done: Callable[[], bool], limit_s: float) -> bool:
        """Wait until a condition holds, at most `limit_s`."""
        end_s = time.monotonic() + limit_s
        with self._arrived:
            while not (is_done() or self.fault() or time.monotonic() > end_s):
                self._arrived.wait(0.01)
        if rospy.is_shutdown():
            raise Unusable('stopped')
        return is_done()

    def fault(self) -> str:
        """Return why the node cannot be judged further."""
        if len(self.odometry) > MOST_MESSAGES:
            self._fault = f'{self._mapping.odom}: {len(self.odometry)} messages'
        for command, process in zip(self._mapping.commands, self._processes):
            if process.poll() is not None:
                self._fault = f'{command}: ended with status {process.returncode}'
        return self._fault

    def reset(self) -> bool:
        """Call the reset service."""
        try:
            call_service(self._mapping.reset, Empty)
        except (rospy.ServiceException, rospy.ROSException):
            return False
        return True

    def memory_bytes(self) -> int:
        """Return the resident memory of the nodes."""
        with contextlib.suppress(OSError):
            pages = [int(Path(f'/proc/{pid}/statm').read_text().split()[1]) for pid in self._pids]
            return sum(pages) * os.sysconf('SC_PAGESIZE')
        return 0

    def stop(self) -> None:
        """End the started processes."""
        for number in (signal.SIGINT, signal.SIGKILL) if self._processes else ():
            for process in self._processes:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, number)
            end_s = time.monotonic() + STOP_S
            while any(process.poll() is None for process in self._processes) and time.monotonic() < end_s:
                time.sleep(0.01)
        if self._processes:  # killed nodes are still registered
            killed = {*rosnode.get_node_names()} - self._nodes_before
            with contextlib.redirect_stdout(None):
                rosnode.cleanup_master_blacklist(self._master, killed)
        self._processes = []

    def restore(self) -> None:
        """Leave the graph as it was."""
        self.stop()
        for node, before in self._before.items() if self._mapping.commands else ():
            with contextlib.suppress(KeyError, OSError):  # no such parameter, or no master
                rospy.delete_param(node)
                if before is not None:
                    rospy.set_param(node, before)


class ConformanceSuite:
    """Plays all cases to a node, and reports the verdicts."""

    def __init__(self) -> None:
        self._options, self._status = parse_conformance_node(), LaunchStatus()
        if rospy.get_param('/use_sim_time', False):
            raise ConfigError('/use_sim_time: given true; allowed: false, as the suite has its own stamps')
        options, self._mapping = self._options, find_mapping(self._options)
        wheels = {name: getattr(options, name) for name in Wheels.model_fields}
        self._wheels = Wheels.from_mapping(wheels, 'conformance_node')
        self._out = users_path(options.out)
        self._out.mkdir(parents=True, exist_ok=True)
        self._subject = RosSubject(self._mapping, self._wheels, self._out / 'node.log')

    def run(self) -> None:
        """Judge the node; exit with status 1 if a clause fails."""
        begin_s, options, subject = time.monotonic(), self._options, self._subject
        settings = None if self._mapping.commands else Settings(options.counter_modulus, options.motion_noise)
        try:
            player = Player(subject, self._mapping, self._wheels)
            recordings, unusable = play_all(plan(self._mapping, self._wheels, settings), player)
        finally:
            subject.restore()
        if rospy.is_shutdown():
            sys.exit(1)
        from diff_encoder_sim.conformance import conformance_page  # noqa: PLC0415 - Altair takes a second

        evidence = Evidence(self._mapping, self._wheels, recordings, unusable, subject.has_stamps)
        verdicts, node = judge(evidence), options.node or OURS[0]
        failed = [verdict for verdict in verdicts if verdict.outcome == FAIL]
        for earlier in self._out.glob('[0-9].[0-9].bag'):
            earlier.unlink()
        for verdict in failed:
            name = verdict.case or USUAL_CASE
            for recording in [each for each in recordings if each.name == name and each.sent_ns][:1]:
                self._write_bag(recording, self._out / f'{verdict.clause.number}.bag')
        junit = report.junit_xml(verdicts, node, time.monotonic() - begin_s)
        for path in [self._out / 'conformance.xml', *map(Path, filter(None, [options.gtest_output[4:]]))]:
            write_file(path, junit)
        conformance_page.write_page(evidence, verdicts, 'conformance_node', self._out / 'conformance.html')
        print(report.verdict_table(verdicts))
        print(self._out / 'conformance.html')
        if failed:
            sys.exit(1)
        self._status.succeed()

    def _write_bag(self, recording: Recording, path: Path) -> None:
        """Write input and output of a case."""
        subject, mapping, wall_ns = self._subject, self._mapping, time.time_ns() - time.monotonic_ns()
        first_ns = recording.sent_ns[0]
        last_ns = max([*recording.sent_ns, *(each.receipt_ns for each in recording.odometry)])
        answers = [(mapping.odom, Odometry, each) for each in subject.odometry]
        answers += [('/tf', TFMessage, each) for each in subject.transforms]
        messages = [(each.receipt_ns, topic, kind, each.content) for topic, kind, each in answers]
        for sent_ns, sample in zip(recording.sent_ns, recording.samples):
            for topic, message in subject.messages(sample):
                content = io.BytesIO()
                message.serialize(content)
                messages.append((sent_ns, topic, type(message), content.getvalue()))
        with Writer(path) as bag:
            connections: Dict[str, Any] = {}
            for time_ns, topic, kind, raw in sorted(messages, key=lambda each: each[0]):
                if first_ns <= time_ns <= last_ns:
                    if topic not in connections:
                        about = {'msgdef': kind._full_text, 'md5sum': kind._md5sum}
                        connections[topic] = bag.add_connection(topic, kind._type.replace('/', '/msg/'), **about)
                    bag.write(connections[topic], wall_ns + time_ns, raw)


def conformance_node() -> None:
    """conformance_node: judge an odometry node on a ROS graph, by the clauses of the conformance suite."""
    parse_conformance_node()  # without a master
    executable('conformance', ConformanceSuite, ConformanceSuite.run)()
