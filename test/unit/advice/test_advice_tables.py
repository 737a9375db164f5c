from advised_robots import whole_advice
from diff_encoder_sim.advice.advice_tables import advice_tables, shown_counts


def tables():
    return {table.title: table for table in advice_tables(whole_advice())}


def test_trials_are_in_the_order_of_encoders():
    table = tables()['Closed-loop trials within the tolerance']
    assert table.heads == ['test', '', '28 PPR', '40 PPR']
    assert table.rows[2] == ['SL', 'true pose at the goal', '12/17', '17/17']


def test_budgets_are_of_the_answers_encoders_and_end_with_what_was_found():
    table = tables()['Error budget: mean ± standard deviation']
    titles = [row[0] for row in table.rows if row[0]]
    counts = shown_counts(whole_advice(), list(whole_advice().budgets['SL']))
    assert titles == [f'SL: odometry at the true pose, {counts:g} PPR', 'SL: true pose at the goal, 40 PPR, 17 trials']
    assert abs(counts - 347.0) < 15.0
    causes = [row[1] for row in table.rows]
    assert causes == [
        *('quantisation', 'simulated contact', 'rest', 'found'),
        *('stopping', 'localization', 'encoder', 'rest', 'found'),
    ]
    assert not any('-0.0 ' in text for row in table.rows for text in row)


def test_encoders_say_yes_no_or_that_it_is_not_known():
    table = tables()['Encoders on these wheels']
    assert table.heads[-4:] == ['odometry', 'pose estimate', 'true pose', 'own errors']
    assert table.rows[0] == ['amt102', 'industrial low', '8192', '586.8', '98 to 100 %', 'yes', 'yes', 'yes', '']
    assert table.rows[1][-4:] == ['no', '?', '?', '']
    assert {len(row) for row in table.rows} == {len(table.heads)}
