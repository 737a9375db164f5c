import json
import re

import pytest

from advised_robots import whole_advice
from diff_encoder_sim.advice.advice_tables import VERSION, advice_json
from places import ROOT


@pytest.fixture(scope='module')
def content():
    return json.loads(json.dumps(advice_json(whole_advice()), allow_nan=False))


def test_answers_are_by_question(content):
    answers = content['answers']
    assert list(answers) == ['odometry', 'pose_estimate', 'truth']
    assert answers['odometry']['kind'] == 'from'
    assert 330.0 < answers['odometry']['smallest_ppr'] < 365.0
    low, high = answers['odometry']['interval']
    assert low <= answers['odometry']['smallest_ppr'] <= high
    assert answers['pose_estimate'] == {
        'kind': 'undecided',
        'smallest_ppr': None,
        'interval': [None, None],
        'encoder': None,
        'limit': [],
        'more_trials': 12,
        'undecided_encoder': None,
        'errors_of': None,
        'text': 'undecided, about 12 more trials of each test would decide',
    }
    assert answers['truth']['encoder'] == '40'


def test_budgets_add_up(content):
    for budget in content['budgets']['SL']:
        for axis in ('along', 'across', 'heading'):
            for key in ('bias', 'variance'):
                parts = sum(part[axis][key] for part in budget['parts'].values())
                assert parts + budget['rest'][axis][key] == pytest.approx(budget['found'][axis][key], abs=1e-12)


def test_the_documentation_names_all_keys(content):
    assert content['version'] == VERSION
    text = (ROOT / 'docs' / 'which_encoder.md').read_text(encoding='utf-8')
    documented = set(re.findall(r'^\| `([^`]+)` \|', text, re.MULTILINE))
    assert set(content) <= {key.split('.')[0].split('[')[0] for key in documented}
    for part in ('answers', 'trials[]', 'encoders[]'):
        value = content
        for name in part.replace('[]', '.0').split('.'):
            value = value[int(name)] if name.isdigit() else value[name]
        names = next(iter(value.values())) if part == 'answers' else value
        prefix = 'answers.<criterion>' if part == 'answers' else part
        assert {f'{prefix}.{name}' for name in names} <= documented
