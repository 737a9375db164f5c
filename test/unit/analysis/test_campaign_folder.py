"""A campaign's files, and those that are not as a campaign wrote them."""

import shutil

import pytest

from analysed_campaigns import finish, refusal
from campaign_files import NOISE, small_campaign
from diff_encoder_sim.analysis.dataset_loading import load_dataset


def test_a_campaign_that_goes_on_is_analysed_as_far_as_it_is(tmp_path, caplog):
    folder = finish(small_campaign(tmp_path), tmp_path / 'out', 3)
    with open(folder / 'trials.csv', 'ab') as table:
        table.write(b'SL,90,2,2,succ')
    dataset = load_dataset([folder])
    assert len(dataset.trials) == 3
    assert 'the last line is incomplete' in dataset.notes[0] and 'has 3 of 8 trials' in dataset.notes[1]
    assert [record.message for record in caplog.records] == dataset.notes


@pytest.mark.parametrize('content', ['', '{', '[]', '{"name": "x"}', '{"name": "x", "configuration": {"tests": []}}'])
def test_a_manifest_that_is_none_is_named(folder, content):
    (folder / 'manifest.json').write_text(content)
    assert refusal(folder).startswith(f'{folder}/manifest.json: not the manifest of a campaign')


def test_a_manifest_of_another_campaign_is_named(folder, tmp_path):
    campaign = small_campaign(tmp_path, tests=['SL'], vary={NOISE: [0.01, 0.03]})
    other = finish(campaign, tmp_path / 'other', 1)
    shutil.copy(other / 'manifest.json', folder)
    assert f'{folder}/trials.csv: line 1 does not belong to the campaign of manifest.json' in refusal(folder)


@pytest.mark.parametrize(
    'change',
    [
        lambda lines: lines + lines[-1:],
        lambda lines: lines[:2] + ['SL,90'] + lines[3:],
        lambda lines: lines[:1] + [lines[1].replace('SL,', 'LS,')] + lines[2:],
        lambda lines: lines[:1] + [lines[1].replace('49.05', 'nan')] + lines[2:],
        lambda lines: lines[:1] + [lines[1].replace('49.05', '1e300')] + lines[2:],
    ],
)
def test_lines_that_are_no_rows_are_named(folder, change):
    path = folder / 'trials.csv'
    path.write_text('\n'.join(change(path.read_text().splitlines())) + '\n')
    assert refusal(folder).startswith(f'{path}: line ')
