"""Navigated trials on the whole graph: they end at the goal by the pose estimate, and a robot carried off stops."""

import math
import sys
import time

import pytest

from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.drives.trial_recording import read_trial
from launched_graph import DATA, ROOT, Graph, complaints, require_ros

pytestmark = [pytest.mark.rostest, pytest.mark.timeout(280)]

TRIAL = ROOT / 'launch' / 'trial.launch'
BEND = 'test:=%s' % (DATA / 'bend.yaml')
GOAL = Pose2D(1.9, -0.935, 0.0)
ELSEWHERE = (2.7, 0.9, math.pi / 2)  # east of the pillars, where no wall is as it was
TRIAL_TOPICS = (
    '/clock',
    '/joint_states',
    '/scan',
    '/gazebo/model_states',
    '/cmd_vel',
    '/encoder_pulse',
    '/odom',
    '/amcl_pose',
    '/global_pose',
    '/world_pose',
    '/map',
    '/tf',
    '/tf_static',
    '/move_base/goal',
    '/move_base/result',
)


@pytest.fixture(scope='module', params=[40])
def finished(request, tmp_path_factory):
    """(bag, launch's output) of a trial that must succeed, as fast as the graph keeps up."""
    require_ros()
    folder = tmp_path_factory.mktemp('bend')
    with Graph(folder) as graph:
        launch = graph.launch(TRIAL, BEND, f'ppr:={request.param}', 'rtf:=0', 'bag:=%s' % (folder / 'trial.bag'))
        assert launch.wait() == 0, launch.output()
        assert graph.is_gone(10.0), 'it left processes behind'
        return folder / 'trial.bag', launch.output()


def test_it_ends_at_its_goal_by_its_pose_estimate(finished):
    recording = read_trial(finished[0])
    assert recording.outcome == Outcome.SUCCEEDED
    end = Pose2D(*recording.poses['/global_pose'].x_y_yaw[-1].tolist()).relative_to(GOAL)
    assert math.hypot(end.x_m, end.y_m) < 0.06  # 0.05 m, latched before it turned
    assert abs(end.yaw_rad) < 0.052
    truth = recording.poses['/world_pose'].x_y_yaw[-1]
    assert math.hypot(truth[0] - GOAL.x_m, truth[1] - GOAL.y_m) < 0.2


def test_the_pose_estimate_follows_the_truth_all_the_way(finished):
    poses = read_trial(finished[0]).poses
    truth = dict(zip(poses['/world_pose'].stamps_ns.tolist(), poses['/world_pose'].x_y_yaw.tolist()))
    errors = [
        math.hypot(x - truth[stamp][0], y - truth[stamp][1])
        for stamp, (x, y, _) in zip(poses['/global_pose'].stamps_ns.tolist(), poses['/global_pose'].x_y_yaw.tolist())
        if stamp in truth
    ]
    assert len(errors) > 200
    assert max(errors) < 0.3


def test_it_runs_without_a_warning_and_records_every_topic(finished):
    from rosbags.highlevel import AnyReader

    bag, output = finished
    assert complaints(output) == []
    with AnyReader([bag]) as reader:
        counts = {topic: info.msgcount for topic, info in reader.topics.items()}
        scans, results = (
            [
                reader.deserialize(raw, connection.msgtype)
                for connection, _, raw in reader.messages(
                    [connection for connection in reader.connections if connection.topic == topic]
                )
            ]
            for topic in ('/scan', '/move_base/result')
        )
    assert [topic for topic in TRIAL_TOPICS if not counts.get(topic)] == []
    stamps_ns = [scan.header.stamp.sec * 10**9 + scan.header.stamp.nanosec for scan in scans]
    assert stamps_ns == list(range(0, 10**8 * len(scans), 10**8))
    # actionlib: 2 preempted, 3 succeeded. The waypoint is passed, not reached.
    assert [result.status.status for result in results] == [2, 3]


def test_carried_off_it_says_so_and_stops_and_goes_on_when_told_where_it_is(tmp_path):
    require_ros()
    with Graph(tmp_path) as graph:
        launch = graph.launch(TRIAL, BEND, 'ppr:=1024', 'rtf:=2', 'bag:=%s' % (tmp_path / 'trial.bag'))
        graph.wait_for_clock(7.0)  # turned, and on its way
        code, output = graph.run(sys.executable, ROOT / 'scripts' / 'place_robot', *ELSEWHERE)
        assert code == 0, output
        wait_for_line(launch, 'lost')
        wait_for_line(launch, 'stopped')
        # It drove on for half a second: set down once more, at the pose that /initialpose will name.
        code, output = graph.run(sys.executable, ROOT / 'scripts' / 'place_robot', *ELSEWHERE)
        assert code == 0, output
        code, output = graph.run(
            'rostopic', 'pub', '-1', '/initialpose', 'geometry_msgs/PoseWithCovarianceStamped', initial_pose(*ELSEWHERE)
        )
        assert code == 0, output
        assert launch.wait() == 0, launch.output()
    recording = read_trial(tmp_path / 'trial.bag')
    end = Pose2D(*recording.poses['/global_pose'].x_y_yaw[-1].tolist())
    assert math.hypot(end.x_m - GOAL.x_m, end.y_m - GOAL.y_m) < 0.06
    # Between the two it stood: the truth did not move for seconds after the stop.
    assert longest_stand_s(recording.poses['/world_pose']) > 1.0


def wait_for_line(launch, text, timeout_s=60.0):
    deadline_s = time.monotonic() + timeout_s
    while text not in launch.output():
        assert time.monotonic() < deadline_s, launch.output()
        time.sleep(0.05)


def initial_pose(x, y, yaw):
    """A message for rostopic, with AMCL's usual spread."""
    quat = '{{x: {:f}, y: {:f}, z: {:f}, w: {:f}}}'.format(*quat_xyzw_from_yaw(yaw))
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = 0.04
    covariance[35] = 0.03
    pose = f'{{position: {{x: {x:f}, y: {y:f}}}, orientation: {quat}}}'
    return f'{{header: {{frame_id: map}}, pose: {{pose: {pose}, covariance: {covariance}}}}}'


def longest_stand_s(series):
    """Return how long a robot stands [s] that drives before and after."""
    longest, since_ns = 0, series.stamps_ns[0]
    for index in range(1, len(series.stamps_ns)):
        step = series.x_y_yaw[index] - series.x_y_yaw[index - 1]
        if abs(step[:2]).max() > 1e-4 or abs(step[2]) > 1e-3:
            since_ns = series.stamps_ns[index]
        longest = max(longest, int(series.stamps_ns[index] - since_ns))
    return longest * 1e-9
