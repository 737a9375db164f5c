from urdf_texts import ball, base, described, pair, robot, usual, wheel


def test_wheels_beside_the_base_frames_axis_are_a_warning():
    off = wheel('left_wheel', y_m=0.16) + wheel('right_wheel', y_m=-0.14)
    description = described(robot(base(), off, ball('ball', 0.1)))
    assert "the wheels' middle is 10.0 mm to the left of the base frame's x axis" in description.warnings[0]


def test_a_plugin_of_other_wheels_says_nothing_of_these():
    drive = (
        '<gazebo><plugin filename="libdiff_drive.so"><leftJoint>a_joint</leftJoint><rightJoint>b_joint</rightJoint>'
        '<wheelDiameter>0.11</wheelDiameter></plugin></gazebo>'
    )
    text = usual(pair(x_m=-0.2, names=('a', 'b')), drive)
    chosen = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}
    assert described(text, **chosen).wheel_diameter_m == 0.1
    assert described(text).wheel_diameter_m == 0.11
