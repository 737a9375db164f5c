"""Which joints are the wheels."""

from diff_encoder_sim.drives.sensor_messages import encode_encoder_pulse
from reencoding_drives import ROS1, START_NS, TICK_NS, angles_rad, write_ros1
from reencoding_runs import contents, run, samples_of


def test_names_of_joints_are_found_or_given(tmp_path):
    names = ('arm', 'front_RIGHT_wheel', 'wheel_l')
    rows = [
        ('/js', START_NS + tick * TICK_NS, ROS1.joint_state(START_NS + tick * TICK_NS, (9.0, right, left), names))
        for tick, (left, right) in enumerate(angles_rad(101))
    ]
    path = write_ros1(tmp_path / 'a.bag', rows)
    run(path, '--ppr', '90', '--out', tmp_path / 'found')
    run(path, '--ppr', '90', '--out', tmp_path / 'given', '--left', 'wheel_l', '--right', 'front_RIGHT_wheel')
    found = contents(tmp_path / 'found' / 'a_90ppr.bag')
    assert found == contents(tmp_path / 'given' / 'a_90ppr.bag')
    assert found['/encoder_pulse'] == [
        encode_encoder_pulse(sample, ('wheel_l', 'front_RIGHT_wheel'))[4:] for sample in samples_of(angles_rad(101), 90)
    ]
