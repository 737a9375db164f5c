"""What benchmark/all.py runs, and what it calls slower."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / 'benchmark'))

from checkout import measured_on
from ratio_changes import changes
from ratios import Ratio, print_ratios, read_measured, write_measured
from wheel_nodes import Run, faults

import all as all_benchmarks

BENCHMARKS = Path(__file__).parent / 'benchmark'
WRITTEN = '{{"host": "", "python": "", "commit": "", "ratios": {{{}}}}}'


@pytest.mark.parametrize(
    ('before', 'now', 'is_slower'),
    [
        ([1.0, 1.1], [1.3, 1.4], True),
        ([1.0, 1.5], [1.4, 1.6], False),  # rounds overlap
        ([1.0, 1.0], [1.05, 1.05], False),  # too little
        ([1.3, 1.4], [1.0, 1.1], False),
    ],
)
def test_slower_is_what_exceeds_the_spread_of_the_rounds(before, now, is_slower):
    [change] = changes([Ratio('trial', 'bare stepping', before)], [Ratio('trial', 'bare stepping', now)])
    assert change.is_slower is is_slower


def test_what_only_one_run_has_is_not_compared():
    assert changes([Ratio('a', 's', [1.0])], [Ratio('b', 's', [2.0]), Ratio('a', 'ms', [2.0])]) == []


def test_ratios_are_read_as_they_were_written_with_what_they_were_measured_on(tmp_path):
    ratios = {'one.py': [Ratio('a', 's', [1.0, 2.5], 3.0), Ratio('b', 'ms', [0.125])]}
    write_measured(tmp_path / 'ratios.json', ratios)
    read = read_measured(tmp_path / 'ratios.json')
    assert read.ratios == ratios
    assert (read.host, read.python, read.commit) == measured_on()


@pytest.mark.parametrize(('median', 'limit'), [(1.49, '1.5'), (1.5, '1.5, is above'), (2.0, '1.5, is above')])
def test_what_does_not_stay_below_its_limit_is_marked(median, limit, capsys):
    print_ratios([Ratio('a', 's', [median], 1.5)])
    assert capsys.readouterr().out.splitlines()[-1].endswith(f'  {limit}')


@pytest.mark.parametrize('name', all_benchmarks.BENCHMARKS)
def test_what_is_gathered_writes_its_ratios(name):
    text = (BENCHMARKS / name).read_text()
    assert 'add_json(parser)' in text and 'write_ratios(arguments.json, ratios)' in text


@pytest.fixture(name='run_all')
def fixture_run_all(monkeypatch):
    """Runs all.py with ROS, and scripts of one ratio each, which do as `script` says: the exit status."""

    def run_all(*arguments, script=lambda name: [Ratio(name, 'bare stepping', [1.0])]):
        def run(name, now):
            now[name] = script(name)
            return bool(now[name])

        monkeypatch.setattr(all_benchmarks, '_run', run)
        monkeypatch.setattr(sys, 'argv', ['all.py', *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            all_benchmarks.main()
        return ended.value.code

    monkeypatch.setattr(all_benchmarks, 'is_sourced', lambda: True)
    return run_all


@pytest.fixture(name='before')
def fixture_before(run_all, tmp_path):
    """JSON of a run of all scripts."""
    assert run_all('--json', tmp_path / 'before.json') == 0
    return tmp_path / 'before.json'


@pytest.mark.parametrize(
    ('ratio', 'status', 'marks'),
    [
        (Ratio('lidar.py', 'bare stepping', [1.0]), 0, []),
        (Ratio('lidar.py', 'bare stepping', [1.5]), 1, ['slower']),
        (Ratio('lidar.py', 'bare stepping', [1.0], 0.5), 0, ['0.5,', 'is', 'above']),  # as it was before
    ],
)
def test_all_shows_what_became_slower_than_in_the_run_before(ratio, status, marks, before, run_all, capsys):
    assert list(read_measured(before).ratios) == list(all_benchmarks.BENCHMARKS)
    assert run_all('--only', 'lidar.py', '--against', before, script=lambda _: [ratio]) == status
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split() for line in lines if line.startswith('lidar.py')]
    assert rows == [['lidar.py', '1', f'{ratio.median:g}', *marks]]
    assert not any(line.startswith(('only', 'another')) for line in lines)


def test_what_is_missing_now_fails_where_it_was_asked_for_and_what_is_new_does_not(before, run_all, capsys):
    now = {'lidar.py': [Ratio('lidar.py', 'bare stepping', [1.0]), Ratio('new', 's', [1.0])]}
    assert run_all('--only', 'lidar.py', '--against', before, script=now.get) == 0
    assert capsys.readouterr().out.splitlines()[-1] == 'only now: new, in units of s'
    now['lidar.py'].pop(0)
    assert run_all('--only', 'lidar.py', '--against', before, script=now.get) == 1
    assert 'only before: lidar.py, in units of bare stepping\n' in capsys.readouterr().out


def test_another_host_than_before_is_said(before, run_all, capsys):
    text = json.dumps({**json.loads(before.read_text()), 'host': 'abacus'})
    before.write_text(text)
    assert run_all('--against', before) == 0
    assert f'another host before: abacus; now: {measured_on().host}\n' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        ('', 'Expecting value'),
        ('{"host"', 'allowed: JSON that --json wrote'),
        ('{}', 'host: missing'),
        ('[]', 'given []; allowed: a mapping'),
        (WRITTEN.format('"lidar.py": [{"name": "", "of": "", "rounds": [NaN]}]'), 'given nan'),
        (WRITTEN.format('"lidar.py": [{"name": "", "of": "", "rounds": []}]'), 'rounds: given []'),
        (WRITTEN.format(''), 'given results of nothing'),
        (None, 'No such file'),
    ],
)
def test_what_cannot_be_compared_with_is_said_before_anything_is_measured(text, complaint, tmp_path, run_all, capsys):
    if text is not None:
        (tmp_path / 'before.json').write_text(text)
    assert run_all('--against', tmp_path / 'before.json', script=pytest.fail) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith('all.py: error: argument --against: ') and complaint in last


@pytest.mark.parametrize('path', ['nowhere/ratios.json', '.'])
def test_what_cannot_be_written_is_said_before_anything_is_measured(path, tmp_path, run_all, capsys):
    assert run_all('--json', tmp_path / path, script=pytest.fail) == 2
    assert 'argument --json: given' in capsys.readouterr().err


def test_a_failing_script_is_said_at_the_end_and_loses_nothing(tmp_path, run_all, capsys):
    def script(name):
        return [] if name == 'growth.py' else [Ratio(name, 's', [1.0])]

    status = run_all('--only', 'growth.py', 'lidar.py', '--json', tmp_path / 'ratios.json', script=script)
    assert status == 'all.py: failed: growth.py'
    assert read_measured(tmp_path / 'ratios.json').ratios == {'growth.py': [], 'lidar.py': script('lidar.py')}


def test_what_a_script_wrote_before_it_failed_is_taken(monkeypatch, tmp_path):
    name = 'fails.py'
    (tmp_path / name).write_text(
        f'import sys; sys.path.insert(0, {str(BENCHMARKS)!r})\n'
        'from pathlib import Path; from ratios import Ratio, write_ratios\n'
        "write_ratios(Path(sys.argv[2]), [Ratio('a', 's', [1.0])]); sys.exit(1)\n"
    )
    monkeypatch.setattr(all_benchmarks, '__file__', str(tmp_path / 'all.py'))
    now = {}
    assert not all_benchmarks._run(name, now)
    assert now == {name: [Ratio('a', 's', [1.0])]}


def test_a_stop_keeps_what_was_measured(tmp_path, run_all, capsys):
    def script(name):
        if name == 'lidar.py':
            raise KeyboardInterrupt
        return [Ratio(name, 's', [1.0])]

    assert run_all('--only', 'growth.py', 'lidar.py', '--json', tmp_path / 'ratios.json', script=script) == 130
    assert capsys.readouterr().err == 'all.py: stopped; measured were: growth.py\n'
    assert list(read_measured(tmp_path / 'ratios.json').ratios) == ['growth.py']


def test_without_ros_the_live_ones_are_left_out_and_named(monkeypatch, tmp_path, run_all, capsys):
    monkeypatch.setattr(all_benchmarks, 'is_sourced', lambda: False)
    assert run_all('--json', tmp_path / 'ratios.json') == 0
    assert 'without live_graph.py, wheel_nodes.py: the workspace is not sourced' in capsys.readouterr().out
    names = list(read_measured(tmp_path / 'ratios.json').ratios)
    assert names == [name for name in all_benchmarks.BENCHMARKS if name not in all_benchmarks.LIVE]


@pytest.mark.parametrize(
    ('name', 'option', 'value'),
    [
        ('start_up.py', '--repeats', '0'),
        ('start_up.py', '--campaigns', '0'),
        ('campaign_overhead.py', '--trials', '100'),
        ('growth.py', '--only', 'zzz'),
    ],
)
def test_arguments_that_measure_nothing_are_refused_in_one_line(name, option, value):
    command = [sys.executable, str(BENCHMARKS / name), option, value]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 2
    assert ended.stderr.splitlines()[-1].startswith(f'{name}: error: argument {option}: given {value!r}; allowed: ')


@pytest.mark.parametrize(
    ('rate_hz', 'lost', 'late_s', 'found'),
    [
        (1000.0, 0, 0.05, []),
        (1000.0, 0, 0.5, ['ideal, 1000 Hz: the last message late by 0.50 s; allowed: 0.1 s']),
        (5000.0, 0, 0.5, []),  # how far it goes is what is looked for
        (5000.0, 3, 0.0, ['ideal, 5000 Hz: 3 of 10 messages on /odom lost; allowed: none']),
    ],
)
def test_wheel_nodes_may_lose_nothing_and_be_late_above_their_rate_alone(rate_hz, lost, late_s, found):
    run = Run(rate_hz, 10, lost, rate_hz, late_s, 0.3, 9.0)
    assert faults({'ideal': [run]}) == [f'wheel_nodes.py: {each}' for each in found]


def test_growth_is_measured_by_size_in_processes_of_their_own(tmp_path):
    command = [BENCHMARKS / 'growth.py', '--only', 'errors along', '--repeats', 1, '--json', tmp_path / 'ratios.json']
    ended = subprocess.run([sys.executable, *map(str, command)], stdout=subprocess.PIPE, text=True, check=True)
    sizes = [line.split()[0] for line in ended.stdout.splitlines() if line[:1] == ' ' and line.split()[0].isdigit()]
    assert sizes == ['10', '100', '1000', '10000']
    ratios = read_measured(tmp_path / 'ratios.json').ratios['growth.py']
    assert [ratio.name for ratio in ratios] == ['errors along a path, by its length [m]: 10000']
