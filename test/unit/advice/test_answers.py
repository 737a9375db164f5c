import math

import pytest

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit

RADIUS = Limit('wheel radius', 'SL', 1, 0.047, 0.05, 0.025)
TURN = Limit('localization', 'SMT', 2, math.radians(4.0), math.radians(3.0), math.radians(1.5))


@pytest.mark.parametrize(
    ('answer', 'text'),
    [
        (
            Answer(Criterion.ODOMETRY, Kind.FROM, 347.0, (340.0, 350.0), '360'),
            'from 347 counts per revolution on (between 340 and 350); of the candidates 360 PPR',
        ),
        (
            Answer(Criterion.TRUTH, Kind.FROM, 40.0, (20.0, 40.0), '40', more_trials=70, undecided='28'),
            (
                'from 40 counts per revolution on; 20 are not enough; '
                '28 PPR undecided, about 70 more trials of each test would decide'
            ),
        ),
        (
            Answer(Criterion.POSE_ESTIMATE, Kind.FROM, 20.0, (None, 20.0), '20'),
            'from 20 counts per revolution on, the coarsest candidate',
        ),
        (
            Answer(Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, 512.0, limits=[RADIUS]),
            (
                'the encoder is not the limit: wheel radius makes 47 of 50 mm across in SL; '
                'if wheel radius made 25 mm: from 512 counts on'
            ),
        ),
        (
            Answer(Criterion.TRUTH, Kind.NOT_THE_LIMIT, limits=[TURN]),
            (
                'the encoder is not the limit: localization makes 4 of 3 degrees heading in SMT; '
                'if localization made 1.5 degrees: still not'
            ),
        ),
        (
            Answer(Criterion.TRUTH, Kind.UNDECIDED, more_trials=30),
            'undecided, about 30 more trials of each test would decide',
        ),
        (
            Answer(Criterion.TRUTH, Kind.NOT_THE_LIMIT, given_up='9 of 17 trials of SL do not come to the goal (lost)'),
            'the encoder is not the limit: 9 of 17 trials of SL do not come to the goal (lost)',
        ),
        (Answer(Criterion.TRUTH, Kind.UNDECIDED), 'undecided'),
    ],
)
def test_an_answer_in_words(answer, text):
    assert str(answer) == text
