"""The order in which recovery behaviours are tried."""

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.navigation.navigator_inputs import StartedRecovery, Trigger
from diff_encoder_sim.navigation.recovery import Recovery, RecoverySequence, RecoveryStep, RecoveryView

VIEW = RecoveryView(0, IDENTITY, IDENTITY, None, None)


class Counted(Recovery):
    """Is done in its second step."""

    def __init__(self, name):
        self.name, self.starts, self.steps = name, 0, 0

    def start(self):
        self.starts, self.steps = self.starts + 1, 0

    def step(self, view):
        self.steps += 1
        return RecoveryStep(self.steps == 2, text=f'step {self.steps}')


def run(sequence):
    """Texts of one behaviour, until it is done."""
    texts, result = [], RecoveryStep(False)
    while not result.is_done:
        result = sequence.step(VIEW)
        texts.append(result.text)
    return texts


def test_each_call_starts_the_next_behaviour():
    first, second = Counted('first'), Counted('second')
    sequence = RecoverySequence([first, second])
    for name in ('first', 'second'):
        assert not sequence.is_exhausted
        sequence.call(Trigger.CONTROLLING, 'blocked')
        assert run(sequence) == [f'{name}: step 1', f'{name}: step 2']
    assert sequence.is_exhausted and (first.starts, second.starts) == (1, 1)
    assert sequence.failure == 'no velocity command was found after 2 recovery behaviours: blocked'


def test_it_begins_anew_once_the_reason_of_the_last_call_is_over():
    sequence = RecoverySequence([Counted('first'), Counted('second')])
    sequence.call(Trigger.CONTROLLING, '')
    run(sequence)
    sequence.restart_after(Trigger.PLANNING)
    sequence.call(Trigger.CONTROLLING, '')
    assert run(sequence)[0] == 'second: step 1'
    sequence.restart_after(Trigger.CONTROLLING)
    sequence.call(Trigger.CONTROLLING, '')
    assert run(sequence)[0] == 'first: step 1'


def test_a_call_starts_a_behaviour_anew_that_was_not_done():
    behaviour = Counted('turn')
    sequence = RecoverySequence([behaviour])
    for _ in range(2):
        sequence.call(Trigger.OSCILLATION, '')
        assert sequence.step(VIEW).text == 'turn: step 1'
    assert behaviour.starts == 2


def test_without_behaviours_it_is_exhausted_at_once():
    sequence = RecoverySequence([])
    sequence.call(Trigger.PLANNING, 'the goal is in an obstacle')
    assert sequence.is_exhausted
    assert sequence.failure == 'no plan was found: the goal is in an obstacle'


def test_a_behaviour_is_reported_in_the_step_that_begins_it():
    sequence = RecoverySequence([Counted('first'), Counted('second')])
    for expected in (StartedRecovery('first', 0, 2), StartedRecovery('second', 1, 2)):
        sequence.call(Trigger.PLANNING, 'blocked')
        sequence.step(VIEW)
        assert sequence.started == expected
        sequence.step(VIEW)
        assert sequence.started is None
