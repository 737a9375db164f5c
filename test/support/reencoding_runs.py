"""Runs of the reencode command, and what they wrote."""

import csv
import struct

import pytest
from rosbags.highlevel import AnyReader

from diff_encoder_sim.cli import reencode
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from reencoding_drives import JOINTS, START_NS, TICK_NS


def run(*arguments):
    reencode.main([str(argument) for argument in arguments])


def complaint(capsys, *arguments):
    """The one line of a run that fails."""
    with pytest.raises(SystemExit) as error:
        run(*arguments)
    text = str(error.value)
    assert text.startswith('reencode: ') and '\n' not in text
    return text


def contents(path):
    """Raw messages by topic, without the seq of their headers."""
    found = {}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(bytes(raw)[4:])
    return found


def counts_of(path):
    """Left and right counts of a bag's /encoder_pulse."""
    return [list(struct.unpack('<qq', raw[-16:])) for raw in contents(path)['/encoder_pulse']]


def rows_of(folder):
    with open(folder / 'reencode.csv', newline='') as file:
        return list(csv.DictReader(file))


def samples_of(angles, ppr):
    """Reports of a live encoder over a drive at 100 Hz."""
    encoder = ReportingEncoder(EncoderParams(ppr=ppr))
    updates = (encoder.update(START_NS + tick * TICK_NS, JOINTS, pair) for tick, pair in enumerate(angles.tolist()))
    return [sample for samples in updates for sample in samples]
