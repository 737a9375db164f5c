"""reencode: compute the odometry of a recorded drive with other encoders."""

from __future__ import annotations

import collections
import logging
import sys
from functools import partial
from typing import Counter, Dict, Iterator, List, Optional, Sequence

from diff_encoder_sim.api.options import DriveOptions
from diff_encoder_sim.base.command_line import as_called, user_errors
from diff_encoder_sim.cli.arguments import read_options

DESCRIPTION = """\
reencode: compute the odometry of a recorded drive with other encoders.

Reads wheel angles (sensor_msgs/JointState) or counts (diff_encoder_sim/EncoderPulse) from a bag, or other numbers of
its messages (--ticks), a table (--csv), or odometry (--odom). Computes /encoder_pulse, /odom and /tf for each encoder
as the live nodes publish them, and prints the error of each odometry against a reference."""

NOTES = """\
Recorded counts give the wheel angle to half a count; a finer encoder is limited by the recorded resolution. Where the
edges of another encoder are is sampled by --draws: the table has the median and 5 to 95 %. Wheel angles (JointState,
--unit rad) and counts of a trial are exact, with one line of errors. Without a reference, odometry is compared with
that of the recorded wheels. Counts of --pulses wrap at the counter_modulus of --config, --robot or the bag's trial;
those of --ticks wrap by the type of their field (int16, uint16, int32, uint32).

Messages without a header are stamped with the time of receipt. Wheels in two topics are paired at the stamps of the
left one. Speeds are integrated by the trapezoidal rule."""

EXAMPLES = [
    'drive.bag --ppr 40 90 1024 4096 --out what_if/',
    'drive.bag --encoder catalogue --ppr 90',
    'drive.bag --ticks /lwheel /rwheel --ticks-per-revolution 360 --ppr 40 90',
    'kobuki.bag --robot kobuki --ticks /mobile_base/sensors/core.left_encoder /mobile_base/sensors/core.right_encoder',
    'jackal.bag --ticks "/feedback.drivers[0].measured_travel" "/feedback.drivers[1].measured_travel" --unit rad',
    '--csv wheels.csv --columns time left right --time-unit us --unit m/s --ppr 40 90',
    '--csv drive.csv --columns 1 2 3 --ticks-per-revolution 4096 --reference-columns 1 4 5 6 --robot my_robot.yaml',
]

API = 'api.recorded_drives'  # imported by the command on demand
parse = partial(read_options, DriveOptions, name='reencode', description=DESCRIPTION, examples=EXAMPLES, notes=NOTES)


@user_errors('reencode')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.recorded_drives import reencoding

    handler, once = logging.StreamHandler(), OnceFilter()
    handler.addFilter(once)
    logging.basicConfig(format=f'{as_called("reencode")}: %(message)s', handlers=[handler])
    done = reencoding(parse(arguments))
    for line in (*once.left_out(), *done.notes):
        print(f'{as_called("reencode")}: {line}', file=sys.stderr)
    print(done.text)
    for file in done.files:
        print(file)


class OnceFilter(logging.Filter):
    """Pass the first warning of each kind, and count the others."""

    def __init__(self) -> None:
        super().__init__()
        self._texts: Dict[str, List[str]] = {}  # first and last text, by kind
        self._others: Counter[str] = collections.Counter()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the record is the first of its kind."""
        kind, text = record.msg, record.getMessage()
        is_first = kind not in self._texts
        first, last = self._texts.get(kind, (text, text))
        self._others[kind] += last != text
        self._texts[kind] = [first, text]
        return is_first

    def left_out(self) -> Iterator[str]:
        """Yield the number of suppressed warnings per kind; repeated equal warnings count once."""
        for kind, count in self._others.items():
            if count:
                yield f'{count} more such as "{self._texts[kind][0]}"'
