from advised_robots import straight_advice, whole_advice
from diff_encoder_sim.advice.advice_tables import answers_text, closed_form_text, tables_text


def test_each_criterion_has_a_line():
    lines = answers_text(whole_advice()).splitlines()
    assert lines[0].startswith('  odometry at the true pose: from 3')
    assert lines[1:] == [
        '  pose estimate at the goal: undecided, about 12 more trials of each test would decide',
        '  true pose at the goal: from 40 counts per revolution on; 28 are not enough',
    ]


def test_the_closed_form_is_by_test():
    assert closed_form_text(straight_advice()) == 'SL 347'


def test_tables_stand_under_their_titles_with_notes_below():
    text = tables_text(whole_advice())
    assert text.startswith('Closed-loop trials within the tolerance\ntest ')
    assert 'rest: what was found less' in text and text.endswith('?: not known.')
