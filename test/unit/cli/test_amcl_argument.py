"""--amcl: which file it takes, and what is wrong with it."""

import pytest

from diff_encoder_sim.cli import advise, campaign

GOOD = ['--config', 'quick', '--out', 'out']


@pytest.mark.parametrize('main', [lambda *more: campaign.main([*GOOD, *more]), lambda *more: advise.main([*more])])
@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ('nothing', "files.amcl: given 'nothing'; allowed: amcl"),
        ('no/where.yaml', "files.amcl: given 'no/where.yaml'; allowed: amcl"),
        ('navigation', 'navigation.yaml: base_global_planner: unknown key'),
        ('bad.yaml', 'bad.yaml: kld_err: given -1'),
    ],
)
def test_a_file_that_cannot_be_read_is_one_line_and_leaves_nothing(main, given, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'bad.yaml').write_text('kld_err: -1\n')
    with pytest.raises(SystemExit) as ended:
        main('--amcl', given)
    assert expected in str(ended.value.code) and '\n' not in str(ended.value.code)
    assert [path.name for path in tmp_path.iterdir()] == ['bad.yaml']
