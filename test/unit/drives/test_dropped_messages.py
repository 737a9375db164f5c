"""Messages that cannot be used."""

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.dropped_messages import DroppedMessages
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


def test_each_topic_has_a_line_with_its_count_and_first_fault():
    dropped = DroppedMessages()
    for topic, text in (('/a', 'torn'), ('/b', 'empty'), ('/a', 'late')):
        dropped.add(topic, InputFault(text))
    assert list(dropped.lines()) == [
        '/a: 2 messages dropped; the first: torn',
        '/b: 1 messages dropped; the first: empty',
    ]
    assert list(DroppedMessages().lines()) == []
