"""The whole graph by trial.launch: what the bags of short trials hold, and how a launch ends."""

import json
import math
import os
import signal
import sys

import pytest

from launched_graph import DATA, ROOT, Graph, complaints, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

TRIAL = ROOT / 'launch' / 'trial.launch'
TICK_NS, PERIOD_NS = 10000000, 50000000  # 100 Hz, 20 Hz
WHEEL_DIAMETER, SEPARATION = 0.2, 0.4
LINE_LENGTH = 2.0
DRIVE_NS = 5500000000  # 2 m at 0.45 m/s, sped up and slowed down at 0.7 m/s^2, take 5.1 s
# Five turns or 20 m may differ from wheel-angle kinematics by a thousandth.
SLIP = 1e-3
OUTPUT = 'launch.txt'


class Bag:
    """What was recorded: messages by topic, each with its stamp."""

    def __init__(self, path):
        from rosbags.highlevel import AnyReader

        self.messages = {}
        with AnyReader([path]) as reader:
            for connection, time_ns, raw in reader.messages():
                message = reader.deserialize(raw, connection.msgtype)
                self.messages.setdefault(connection.topic, []).append((stamp_of(message, time_ns), message))

    def __getitem__(self, topic):
        return self.messages[topic]

    def stamps(self, topic):
        return [stamp for stamp, _ in self.messages[topic]]

    def text(self, topic):
        ((_, message),) = self.messages[topic]
        return json.loads(message.data)

    def pulses(self):
        return [(stamp, tuple(int(count) for count in message.pulses)) for stamp, message in self['/encoder_pulse']]

    def angles(self):
        return [(stamp, tuple(message.position)) for stamp, message in self['/joint_states']]

    def poses(self, topic):
        """[(stamp, (x, y, yaw))]"""
        found = []
        for stamp, message in self[topic]:
            pose = message.pose.pose if topic == '/odom' else message.pose
            found.append(
                (stamp, (pose.position.x, pose.position.y, 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)))
            )
        return found


def stamp_of(message, otherwise_ns):
    header = getattr(message, 'header', None)
    return otherwise_ns if header is None else header.stamp.sec * 1000000000 + header.stamp.nanosec


def run_trial(folder, *arguments):
    """A trial that must succeed, as fast as the graph keeps up."""
    require_ros()
    with Graph(folder) as graph:
        bag = folder / 'trial.bag'
        launch = graph.launch(TRIAL, 'nav:=scripted', 'rtf:=0', f'bag:={bag}', *arguments)
        assert launch.wait() == 0, launch.output()
        assert graph.is_gone(10.0), 'it left processes behind'
        (folder / OUTPUT).write_text(launch.output())
        return bag


@pytest.fixture(scope='module')
def line_bags(tmp_path_factory):
    """The same trial of the straight line, run twice."""
    folder = tmp_path_factory.mktemp('line')
    return [
        run_trial(folder / name, 'test:=%s' % (DATA / 'short_line.yaml'), 'ppr:=40', 'trial:=7')
        for name in ('first', 'second')
    ]


@pytest.fixture(scope='module')
def turn_bag(tmp_path_factory):
    """A turn in place, with another encoder on each wheel."""
    return run_trial(
        tmp_path_factory.mktemp('turn'),
        'test:=%s' % (DATA / 'one_turn.yaml'),
        'ppr:={left: 90, right: 1024}',
        'trial:=8',
    )


@pytest.fixture(scope='module')
def line(line_bags):
    return Bag(line_bags[0]), (40, 40)


@pytest.fixture(scope='module')
def turn(turn_bag):
    return Bag(turn_bag), (90, 1024)


@pytest.fixture(params=['line', 'turn'])
def trial(request):
    """(bag, pulses per revolution of both wheels)"""
    return request.getfixturevalue(request.param)


def test_trials_run_without_a_warning(line_bags, turn_bag):
    for bag in [*line_bags, turn_bag]:
        assert complaints(bag.with_name(OUTPUT).read_text()) == []


def test_bag_is_complete(trial):
    bag, ppr = trial
    for topic in (
        '/trial',
        '/trial_result',
        '/clock',
        '/joint_states',
        '/cmd_vel',
        '/encoder_pulse',
        '/odom',
        '/world_pose',
        '/global_pose',
        '/tf',
        '/tf_static',
        '/diagnostics',
    ):
        assert bag.messages.get(topic), topic
    assert bag.text('/trial_result')['outcome'] == 'succeeded'
    assert bag.text('/trial')['ppr'] == {'left': ppr[0], 'right': ppr[1]}


def test_the_bag_has_the_diagnostics_of_each_simulated_second(trial):
    bag, _ = trial
    for name in ('gz_diff_encoder_node: Counts', 'gz_diff_odom_node: Odometry'):
        stamps = [stamp for stamp, message in bag['/diagnostics'] if message.status[0].name == name]
        steps = [later - earlier for earlier, later in zip(stamps, stamps[1:])]
        assert stamps[0] <= PERIOD_NS and set(steps) == {1000000000}
        assert stamps[-1] > bag.stamps('/odom')[-1] - 1000000000


def test_no_sample_is_lost(trial):
    bag, _ = trial
    end_ns = bag.stamps('/joint_states')[-1]
    assert end_ns > 100 * PERIOD_NS
    check_stamps(bag, '/joint_states', TICK_NS, end_ns, may_lack_last=False)
    check_stamps(bag, '/encoder_pulse', PERIOD_NS, end_ns, may_lack_last=False)
    for topic in ('/odom', '/world_pose', '/global_pose'):  # one for one; the last may be on its way when all ends
        check_stamps(bag, topic, PERIOD_NS, end_ns, may_lack_last=True)


def check_stamps(bag, topic, period_ns, end_ns, may_lack_last):
    stamps, expected = bag.stamps(topic), list(range(0, end_ns + 1, period_ns))
    missing = [stamp_ns / 1e9 for stamp_ns in expected if stamp_ns not in stamps]
    extra = [stamp_ns / 1e9 for stamp_ns in stamps if stamp_ns not in expected]
    assert extra == [], topic
    assert missing == [] or (may_lack_last and missing == [expected[-1] / 1e9]), f'{topic} lacks {missing}'
    assert stamps == sorted(set(stamps)), topic


def test_pulses_are_equation_one_of_the_joint_angles(trial):
    bag, ppr = trial
    angles = dict(bag.angles())
    moved = [set(), set()]
    for stamp, pulses in bag.pulses():
        for wheel in (0, 1):
            assert pulses[wheel] == math.floor(angles[stamp][wheel] * ppr[wheel] / (2.0 * math.pi))
            moved[wheel].add(pulses[wheel])
    assert min(len(counts) for counts in moved) > 20


def test_odometry_is_dead_reckoning_of_the_pulses(trial):
    bag, ppr = trial
    expected = dead_reckoning(bag.pulses(), [math.pi * WHEEL_DIAMETER / wheel_ppr for wheel_ppr in ppr])
    for stamp, (x, y, yaw) in bag.poses('/odom'):
        assert math.hypot(x - expected[stamp][0], y - expected[stamp][1]) < 1e-9
        assert abs(wrapped(yaw - expected[stamp][2])) < 1e-9


def dead_reckoning(pulses, m_per_pulse):
    """{stamp: (x, y, yaw)} by chords of arcs."""
    first = previous = pulses[0][1]
    x = y = yaw = 0.0
    poses = {}
    for stamp, counts in pulses:
        left, right = ((counts[wheel] - previous[wheel]) * m_per_pulse[wheel] for wheel in (0, 1))
        turned = [(counts[wheel] - first[wheel]) * m_per_pulse[wheel] for wheel in (0, 1)]
        new_yaw = (turned[1] - turned[0]) / SEPARATION
        half = 0.5 * (new_yaw - yaw)
        chord = 0.5 * (left + right) * (math.sin(half) / half if half else 1.0)
        x, y = x + chord * math.cos(yaw + half), y + chord * math.sin(yaw + half)
        yaw, previous = new_yaw, counts
        poses[stamp] = (x, y, yaw)
    return poses


def wrapped(angle):
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def test_heading_stays_within_a_pulse_a_wheel_of_the_truth(trial):
    """Each wheel's count is less than one pulse off, at any time and however long the way."""
    bag, ppr = trial
    bound = sum(math.pi * WHEEL_DIAMETER / wheel_ppr for wheel_ppr in ppr) / SEPARATION
    truth = dict(bag.poses('/world_pose'))
    start_yaw = truth[0][2]
    errors = [
        abs(wrapped(yaw - (truth[stamp][2] - start_yaw))) for stamp, (_, _, yaw) in bag.poses('/odom') if stamp in truth
    ]
    assert max(errors) < bound + SLIP * 2.0 * math.pi
    assert max(errors) > 0.1 * bound  # an odometry without an encoder would be far better


def test_line_ends_within_the_quantisation_bound(line):
    bag, _ = line
    pulse = math.pi * WHEEL_DIAMETER / 40
    truth, odom = bag.poses('/world_pose')[-1][1], bag.poses('/odom')[-1][1]
    start = bag.poses('/world_pose')[0][1]
    assert start == pytest.approx((-10.0, 0.0, 0.0), abs=1e-4)
    driven = truth[0] - start[0]
    assert driven == pytest.approx(LINE_LENGTH, abs=SLIP * LINE_LENGTH + 0.002)
    # Straight ahead both wheels turn alike, so at most one pulse between them bends the whole way.
    heading_bound = pulse / SEPARATION
    assert abs(odom[1] - truth[1]) < heading_bound * LINE_LENGTH + SLIP * LINE_LENGTH
    assert abs(odom[0] - driven) < pulse + 0.5 * heading_bound**2 * LINE_LENGTH + SLIP * LINE_LENGTH


def test_turn_goes_round_in_place(turn):
    bag, _ = turn
    truth = [pose for _, pose in bag.poses('/world_pose')]
    assert truth[0] == pytest.approx((-3.4, -0.85, 0.5), abs=1e-4)
    turned = sum(wrapped(newer[2] - older[2]) for older, newer in zip(truth, truth[1:]))
    assert turned == pytest.approx(0.9 * 2.0 * math.pi, rel=SLIP, abs=0.003)
    assert math.hypot(truth[-1][0] + 3.4, truth[-1][1] + 0.85) < 0.01


def test_global_pose_is_the_start_and_the_odometry(turn):
    """Without localization the map is known from the surveyed start."""
    bag, _ = turn
    globally = dict(bag.poses('/global_pose'))
    for stamp, (x, y, yaw) in bag.poses('/odom'):
        if stamp in globally:
            expected = (-3.4 + math.cos(0.5) * x - math.sin(0.5) * y, -0.85 + math.sin(0.5) * x + math.cos(0.5) * y)
            assert globally[stamp][:2] == pytest.approx(expected, abs=1e-6)
            assert abs(wrapped(globally[stamp][2] - 0.5 - yaw)) < 1e-6


def test_same_trial_twice_is_the_same(line_bags):
    """Which simulated time each command takes effect at does not depend on the load of the host."""
    first, second = (Bag(path) for path in line_bags)
    for contents in (Bag.angles, Bag.pulses):
        one, other = contents(first), contents(second)
        shorter = min(len(one), len(other))
        assert (
            one[shorter - 1][0] > DRIVE_NS
        )  # the run is paused by a service call: only the rest at its end may differ
        assert one[:shorter] == other[:shorter]


def test_analyze_tells_where_odometry_and_truth_ended(line_bags, turn_bag, tmp_path):
    bag = Bag(line_bags[0])
    with Graph(tmp_path) as graph:
        code, output = graph.run(
            sys.executable, ROOT / 'scripts' / 'analyze', line_bags[0], turn_bag, '--out', tmp_path / 'analysis'
        )
    assert code == 0, output
    (row,) = [
        line.split() for line in output.splitlines() if line.split()[:4] == ['short_line', '40', '7', 'succeeded']
    ]
    # Of odometry from its own start, of the truth from the surveyed one, 10 m behind the map's origin.
    for column, topic, start_x in ((6, '/odom', 0.0), (10, '/world_pose', -10.0)):  # nothing of AMCL
        x_m, y_m, _ = bag.poses(topic)[-1][1]
        assert float(row[column]) == pytest.approx(math.hypot(x_m - start_x - LINE_LENGTH, y_m), abs=2e-4), topic
    assert any(line.split()[:2] == ['one_turn', '90-1024'] for line in output.splitlines()), output
    assert (tmp_path / 'analysis' / 'report.html').is_file()


# --- how a launch ends ------------------------------------------------------------------------------------------------


class Run:
    """A trial in real time that is on its way and would take a minute."""

    def __init__(self, folder, launch_file=TRIAL, *arguments):
        require_ros()
        self.graph = Graph(folder)
        self.bag = folder / 'trial.bag'
        self.launch = self.graph.launch(
            launch_file, 'nav:=scripted', 'test:=SL', 'ppr:=40', f'bag:={self.bag}', *arguments
        )

    def __enter__(self):
        try:
            self.graph.wait_for_clock(0.5)
        except BaseException:
            self.graph.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.graph.__exit__()

    def check_failed(self):
        assert self.launch.wait() == -signal.SIGINT, self.launch.output()  # 130 in a shell, which prints nothing
        assert self.graph.is_gone(10.0), 'it left processes behind'

    def check_bag_is_torn(self):
        """Recorded so far, but without a result."""
        if self.bag.exists():  # else rosbag left an .active file, which nobody takes for a trial's bag
            recorded = Bag(self.bag).messages
            assert '/joint_states' in recorded
            assert '/trial_result' not in recorded


@pytest.mark.parametrize('node', ['gz_diff_odom_node'])
def test_launch_fails_with_a_killed_node(tmp_path, node):
    with Run(tmp_path) as run:
        os.kill(run.launch.pid_of(node), signal.SIGKILL)
        run.check_failed()
        run.check_bag_is_torn()


@pytest.mark.parametrize('number', [signal.SIGTERM])
def test_launch_fails_when_it_is_stopped(tmp_path, number):
    with Run(tmp_path) as run:
        run.launch.send_signal(number)
        run.check_failed()


def test_launch_fails_on_ctrl_c_and_analyze_calls_the_bag_torn(tmp_path):
    with Run(tmp_path) as run:
        run.launch.send_signal(signal.SIGINT)
        run.check_failed()
        run.check_bag_is_torn()
        assert run.bag.exists()
        code, output = run.graph.run(sys.executable, ROOT / 'scripts' / 'analyze', run.bag)
        assert code == 0, output
        assert 'torn' in output
        assert 'succeeded' not in output


def test_launch_fails_when_time_stands_still(tmp_path):
    with Run(tmp_path, DATA / 'impatient_trial.launch') as run:
        code, output = run.graph.run('rosservice', 'call', '/gazebo/pause_physics')
        assert code == 0, output
        run.check_failed()
        assert 'trial failed: no /world_pose for 4 s' in run.launch.output()
        result = Bag(run.bag).text('/trial_result')
        assert result['outcome'] == 'failed'
        assert '/world_pose' in result['reason']
