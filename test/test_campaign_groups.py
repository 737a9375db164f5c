"""The campaign command where trials share a drive of the robot: every one ends up once, whichever of them goes wrong.

Trials take no time (campaign_trials.py); what they compute together has tests of its own.
"""

import campaign_trials
import pytest

from campaign_processes import Machine, campaign_lines, finish, results

pytestmark = pytest.mark.timeout(300)

SCRIPTED = ('--nav', 'scripted', '--ppr', '40', '90', '1024', '--trials', '4')
ALL = {f'{trial}_{ppr}' for trial in range(1, 5) for ppr in (40, 90, 1024)}


@pytest.fixture
def machine(tmp_path):
    machine = Machine(tmp_path)
    yield machine
    machine.close()


def begun(machine):
    """What was begun at once, in alphabetical order."""
    return sorted((machine.folder / campaign_trials.GROUPS).read_text().splitlines())


def done(machine):
    return {f'{row["trial"]}_{row["ppr"]}' for row in results(machine.out)[0]}


def test_trials_that_differ_in_the_encoder_are_run_at_once(machine):
    code, _, err = finish(machine.campaign('--workers', '1', *SCRIPTED))  # of two the last drive may be halved
    assert (code, campaign_lines(err)) == (0, [])
    assert '12 of 12 trials' in err[-1]
    assert begun(machine) == [f'{trial}_40 {trial}_90 {trial}_1024' for trial in range(1, 5)]
    rows, bags = results(machine.out)
    assert [(row['ppr'], int(row['trial'])) for row in rows] == [
        (ppr, trial) for ppr in ('40', '90', '1024') for trial in range(1, 5)
    ]
    assert len(bags) == 12


@pytest.mark.parametrize(
    ('fault', 'said'),
    [('raises_2_90', 'ZeroDivisionError: of trial 2'), ('kills_2_90', 'each worker that began it died')],
    ids=['raises', 'kills'],
)
def test_a_trial_that_goes_wrong_is_found_and_the_others_of_its_drive_are_run(machine, fault, said):
    (machine.folder / fault).touch()
    code, _, err = finish(machine.campaign('--workers', '2', *SCRIPTED))
    assert code == 1
    (line,) = [line for line in campaign_lines(err) if 'could not be run' in line]
    assert line == f'campaign: 1 trial could not be run ({said}): SL_90_002'
    assert done(machine) == ALL - {'2_90'}
    assert {'2_40', '2_90', '2_1024'} <= set(begun(machine))  # each alone
    # The rest of the campaign, when it is run again.
    (machine.folder / fault).unlink()
    assert finish(machine.campaign('--workers', '2', '--resume', *SCRIPTED))[0] == 0
    assert done(machine) == ALL


def test_of_a_drive_that_is_done_in_part_only_the_rest_is_run(machine):
    assert finish(machine.campaign('--workers', '1', *SCRIPTED))[0] == 0
    whole = results(machine.out)
    for name in ('SL_40_003.bag', 'SL_1024_003.bag', 'SL_90_004.bag'):  # a trial without its bag is not done
        (machine.out / 'bags' / name).unlink()
    (machine.folder / campaign_trials.GROUPS).unlink()
    assert finish(machine.campaign('--workers', '1', '--resume', *SCRIPTED))[0] == 0
    assert begun(machine) == ['3_40 3_1024', '4_90']
    assert results(machine.out) == whole
