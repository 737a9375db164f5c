"""Messages that cannot be used."""

import numpy as np

from reencoding_drives import JOINTS, drive, write_ros1
from reencoding_runs import run


def test_bad_messages_are_counted_and_the_rest_is_used(tmp_path, capsys):
    rows = drive()
    joints = [index for index, row in enumerate(rows) if row[0] == '/joint_states']
    for index in joints[10:20]:
        rows[index][2].position[0] = np.nan
    rows[joints[30]][2].name[0] = JOINTS[1]
    rows[joints[30]][2].position = np.zeros(2)
    run(write_ros1(tmp_path / 'a.bag', rows), '--ppr', '90', '40')
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if 'dropped' in line] == [
        "reencode: %s: /joint_states: 11 messages dropped; the first: joint 'left_wheel_joint' has "
        'position nan; expected a finite angle [rad]' % (tmp_path / 'a.bag')
    ]
