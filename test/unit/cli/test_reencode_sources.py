"""Options of reencode that contradict each other."""

import pytest

from diff_encoder_sim.api.wheel_options import check_seed, check_wheel_options, recorded_robot
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode import parse

LEFT_RIGHT = ['--ticks', '/lwheel', '/rwheel']


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
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


def check_seed_of(*arguments):
    options = parse(['a.bag', '--seed', '3', *map(str, arguments)])
    check_seed(options, recorded_robot(options, None))


@pytest.mark.parametrize('arguments', [[], ['--pulses', '/p'], [*LEFT_RIGHT, '--unit', 'rad']])
def test_a_seed_of_nothing_is_refused(arguments):
    with pytest.raises(ConfigError) as caught:
        check_seed_of(*arguments)
    assert str(caught.value).startswith('--seed: given 3, but nothing is drawn from it; allowed: with --encoder')


@pytest.mark.parametrize('config', ['encoder: {edge_error: 0.1}', 'report: {lost: 0.1}'])
def test_a_seed_is_of_errors_in_a_file(tmp_path, config):
    path = tmp_path / 'mine.yaml'
    path.write_text(f'{config}\n')
    check_seed_of('--config', path)


@pytest.mark.parametrize('arguments', [['--encoder', 'amt102'], ['--odom', '/odom'], [*LEFT_RIGHT, '--unit', 'm/s']])
def test_a_seed_is_of_a_real_encoder_and_of_angles_at_the_start(arguments):
    check_seed_of(*arguments)
