"""What benchmark/all.py runs, and what it calls slower."""

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / 'benchmark'))

from ratio_changes import changes
from ratios import Ratio, read_ratios, write_ratios

import all as all_benchmarks

BENCHMARKS = Path(__file__).parent / 'benchmark'


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


def test_ratios_are_read_as_they_were_written(tmp_path):
    ratios = [Ratio('a', 's', [1.0, 2.5], 3.0), Ratio('b', 'ms', [0.125])]
    write_ratios(tmp_path / 'ratios.json', ratios)
    assert read_ratios(tmp_path / 'ratios.json') == ratios


@pytest.mark.parametrize('name', all_benchmarks.BENCHMARKS)
def test_what_is_gathered_writes_its_ratios(name):
    text = (BENCHMARKS / name).read_text()
    assert 'add_json(parser)' in text and 'write_ratios(arguments.json, ratios)' in text


def run_all(monkeypatch, ratio, *arguments):
    """all.py with benchmarks of which each has this ratio."""
    monkeypatch.setattr(all_benchmarks, '_run', lambda name: [Ratio(name, 'bare stepping', [ratio])])
    monkeypatch.setattr(sys, 'argv', ['all.py', *map(str, arguments)])
    all_benchmarks.main()


def test_all_shows_what_became_slower_than_in_the_run_before(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(all_benchmarks, 'is_sourced', lambda: True)
    run_all(monkeypatch, 1.0, '--json', tmp_path / 'before.json')
    assert [ratio.name for ratio in read_ratios(tmp_path / 'before.json')] == list(all_benchmarks.BENCHMARKS)
    for ratio, status in ((1.0, 0), (1.5, 1)):
        with pytest.raises(SystemExit) as ended:
            run_all(monkeypatch, ratio, '--only', 'lidar.py', 'growth.py', '--against', tmp_path / 'before.json')
        assert ended.value.code == status
        lines = capsys.readouterr().out.splitlines()
        assert [line.split() for line in lines if line.startswith('lidar.py')] == [
            ['lidar.py', '1', f'{ratio:g}', *(['slower'] if status else [])]
        ]


def test_without_ros_the_live_ones_are_left_out_and_named(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(all_benchmarks, 'is_sourced', lambda: False)
    run_all(monkeypatch, 1.0, '--json', tmp_path / 'ratios.json')
    assert 'without live_graph.py, wheel_nodes.py: the workspace is not sourced' in capsys.readouterr().out
    names = [ratio.name for ratio in read_ratios(tmp_path / 'ratios.json')]
    assert names == [name for name in all_benchmarks.BENCHMARKS if name not in all_benchmarks.LIVE]


def test_growth_is_measured_by_size_in_processes_of_their_own(tmp_path):
    command = [BENCHMARKS / 'growth.py', '--only', 'errors along', '--repeats', 1, '--json', tmp_path / 'ratios.json']
    ended = subprocess.run([sys.executable, *map(str, command)], stdout=subprocess.PIPE, text=True, check=True)
    sizes = [line.split()[0] for line in ended.stdout.splitlines() if line[:1] == ' ' and line.split()[0].isdigit()]
    assert sizes == ['10', '100', '1000', '10000']
    assert [ratio.name for ratio in read_ratios(tmp_path / 'ratios.json')] == [
        'errors along a path, by its length [m]: 10000'
    ]
