"""What campaign, advise and trial.launch say of encoders before trials run."""

from campaign_files import small_campaign
from diff_encoder_sim.api.notes import name_encoders, name_rates


def test_a_real_encoders_counts_are_explained(tmp_path, capsys):
    name_encoders('campaign', small_campaign(tmp_path, encoders=['amt102']).encoders, 0.2)
    out, err = capsys.readouterr()
    assert out == '' and err.startswith('campaign: amt102 (CUI Devices AMT102-V')
    assert err.endswith('): 2048 lines x 4 = 8192 counts per wheel revolution, 13038 per metre\n')


def test_each_rate_that_joint_states_do_not_have_is_a_line(capsys):
    name_rates('advise', [20.0, 1000.0, 100.0, 150.0, 1000.0])
    out, err = capsys.readouterr()
    assert (out, err.splitlines()) == (
        '',
        [
            'advise: rate: 1000 Hz of reports, but joint states come at 100 Hz: so do reports',
            'advise: rate: 150 Hz of reports, but joint states come at 100 Hz: so do reports',
        ],
    )
