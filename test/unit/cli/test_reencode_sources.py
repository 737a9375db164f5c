"""Options of reencode that contradict each other."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_arguments import parse
from diff_encoder_sim.cli.reencode_sources import check_wheel_options

LEFT_RIGHT = ['--ticks', '/lwheel', '/rwheel']


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (
            ['a.bag', '--seed', '2'],
            '--seed: given with wheel angles of joints; allowed: with --odom or --ticks or --csv',
        ),
        ([], 'BAG, --csv: given neither; allowed: one of them'),
        (['a.bag', '--csv', 'a.csv'], 'BAG, --csv: given both; allowed: one of them'),
        (['a.bag', '--odom', '/o', '--pulses', '/p'], '--pulses, --odom: given both; allowed: one of them'),
        (
            ['a.bag', '--odom', '/o', *LEFT_RIGHT, '--csv', 'b'],
            '--ticks, --odom, --csv: given all; allowed: one of them',
        ),
        (['--csv', 'a.csv'], '--csv: given without --columns; expected --columns TIME LEFT RIGHT, as names or numbers'),
        (['a.bag', '--columns', '1', '2', '3'], '--columns: given with wheel angles of joints; allowed: with --csv'),
        (['a.bag', *LEFT_RIGHT, '--time-unit', 's'], '--time-unit: given with --ticks; allowed: with --csv'),
        (['a.bag', '--unit', 'rad'], '--unit: given with wheel angles of joints; allowed: with --ticks or --csv'),
        (['a.bag', '--odom', '/o', '--unit', 'rad'], '--unit: given with --odom; allowed: with --ticks or --csv'),
        (
            ['a.bag', '--ticks-modulus', '0'],
            '--ticks-modulus: given with wheel angles of joints; allowed: with --ticks or',
        ),
        (
            ['a.bag', '--reversed', 'left'],
            '--reversed: given with wheel angles of joints; allowed: with --ticks or --csv',
        ),
        (['a.bag', *LEFT_RIGHT, '--left', 'l'], '--left: given with --ticks; allowed: with --joint-states or --pulses'),
        (['a.bag', *LEFT_RIGHT, '--pulses-ppr', '9'], '--pulses-ppr: given with --ticks; allowed: with --pulses'),
    ],
)
def test_options_of_another_source_are_refused(arguments, text):
    with pytest.raises(ConfigError) as caught:
        check_wheel_options(parse(arguments))
    assert str(caught.value).startswith(text)
