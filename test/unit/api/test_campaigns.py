"""Campaigns from a program. test/test_notebooks.py runs one."""

import pytest

from diff_encoder_sim import api
from trial_bags import trial, write_bag


def test_bags_are_read_and_reported(tmp_path):
    results = api.read_results(write_bag(tmp_path / 'a.bag', trial()))
    (only,) = results.trials.itertuples()
    assert (only.test, only.ppr) == ('SL', '40') and only.world_y_m == pytest.approx(0.1)
    assert 'SL' in api.summary(results)
    report = api.write_report(results, tmp_path / 'report')
    assert report == tmp_path / 'report' / 'report.html' and report.is_file()


@pytest.mark.parametrize(
    ('options', 'named'),
    [
        ({'config': 'none'}, 'none'),
        ({'trials': 0}, 'trials'),
        ({'tests': ['XX']}, 'XX'),
        ({'amcl': 'nothing'}, "files.amcl: given 'nothing'; allowed: amcl"),
        ({'amcl': 'navigation'}, 'navigation.yaml: base_global_planner: unknown key'),
    ],
)
def test_a_mistake_is_an_error_of_one_line_and_leaves_nothing(options, named, tmp_path):
    with pytest.raises(api.ConfigError) as error:
        api.run_campaign(tmp_path / 'results', **options)
    assert named in str(error.value) and '\n' not in str(error.value)
    assert not (tmp_path / 'results').exists()
