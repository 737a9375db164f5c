"""The queue of a trial in lockstep: what happens when, and in which order."""

from diff_encoder_sim.trials.schedule import Schedule


def test_actions_come_at_their_rates_and_those_of_one_time_in_the_order_entered():
    schedule, done = Schedule(), []
    schedule.every(10, lambda: done.append('fast'))
    schedule.every(30, lambda: done.append('slow'))
    for time_ns in range(0, 61, 10):
        done.append(time_ns)
        schedule.run_until(time_ns)
    assert done == [
        0,
        'fast',
        'slow',
        10,
        'fast',
        20,
        'fast',
        30,
        'fast',
        'slow',
        40,
        'fast',
        50,
        'fast',
        60,
        'fast',
        'slow',
    ]


def test_what_was_put_off_comes_after_what_has_a_rate_and_in_the_order_in_which_it_was():
    schedule, done = Schedule(), []
    schedule.at(20, lambda: done.append('first'))
    schedule.every(10, lambda: done.append('rate'))
    schedule.at(20, lambda: done.append('second'))
    schedule.run_until(10)
    assert done == ['rate', 'rate']
    schedule.run_until(20)
    assert done == ['rate', 'rate', 'rate', 'first', 'second']
    schedule.run_until(25)
    assert done[5:] == []


def test_what_is_put_off_to_now_is_done_now():
    schedule, done = Schedule(), []

    def answer():
        schedule.at(0, lambda: done.append('answer'))

    schedule.every(10, answer)
    schedule.every(10, lambda: done.append('other'))
    schedule.run_until(0)
    assert done == ['other', 'answer']


def test_a_period_that_is_no_multiple_of_the_steps_is_caught_up_with():
    schedule, times = Schedule(), []
    schedule.every(15, lambda: times.append(now_ns))
    for now_ns in range(0, 70, 10):
        schedule.run_until(now_ns)
    assert times == [0, 20, 30, 50, 60]
