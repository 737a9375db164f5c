"""What campaign, advise and trial.launch say of the stop before trials run."""

from campaign_files import small_campaign
from diff_encoder_sim.api.notes import name_stopping, name_stopping_of_trial
from diff_encoder_sim.trials.robot_params import load_robot_params
from places import CONFIG

STOP, TOLERANCE = 'navigation.DWAPlannerROS.stop', 'navigation.DWAPlannerROS.xy_goal_tolerance'


def said(capsys, campaign, tolerance_m=0.05, tolerance_deg=3.0):
    name_stopping('campaign', campaign, tolerance_m, tolerance_deg)
    out, err = capsys.readouterr()
    assert out == ''
    return err.splitlines()


def test_one_line_for_all_cells(tmp_path, capsys):
    (line,) = said(capsys, small_campaign(tmp_path))
    assert line.startswith('campaign: stopping: precise drives up to within about ')


def test_each_stop_that_is_varied_has_its_line(tmp_path, capsys):
    lines = said(capsys, small_campaign(tmp_path, vary={STOP: ['latch', 'precise']}))
    assert [line.split()[2] for line in lines] == ['latch', 'precise']


def test_drives_without_feedback_have_no_stop(tmp_path, capsys):
    assert said(capsys, small_campaign(tmp_path, nav='scripted')) == []


def test_a_stop_that_spends_more_than_results_are_judged_by_is_a_warning(tmp_path, capsys):
    wide = {'set': {STOP: 'latch', TOLERANCE: 0.1}}
    _, warning = said(capsys, small_campaign(tmp_path, **wide))
    assert 'stopping alone may end 80 mm and 3.0 degrees from a goal, whatever the encoder' in warning
    assert len(said(capsys, small_campaign(tmp_path, **wide), 0.081)) == 1
    assert len(said(capsys, small_campaign(tmp_path, **wide), 0.081, 2.0)) == 2
    wide['set'][STOP] = 'precise'
    assert len(said(capsys, small_campaign(tmp_path, **wide))) == 1


def test_a_live_trial_says_it_for_the_stack_it_runs(capsys):
    params = load_robot_params(CONFIG)
    for nav, expected in (('embedded', 'stopping: precise'), ('upstream', 'anywhere within 50 mm'), ('scripted', '')):
        name_stopping_of_trial(nav, params)
        assert expected in capsys.readouterr().err
