"""Rows of trials.csv: what they say, and that they read back."""

import pytest

from campaign_files import NOISE, row_of_job
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.results import csv_fields, csv_line, fields_of, header, row_of


def test_columns_carry_units():
    names = header([NOISE])
    assert names[:5] == ['test', 'ppr', NOISE, 'trial', 'seed'] and len(names) == len(set(names))
    assert {
        'duration_s',
        'odom_x_m',
        'amcl_y_m',
        'global_yaw_rad',
        'world_x_m',
        'distance_m',
        'wall_time_s',
        'bag',
    } <= set(names)


def test_a_row_reads_back_exactly_but_for_wall_time(campaign):
    for job in campaign.trials():
        row = row_of_job(campaign, job, 'bags/x.bag', wall_time_s=1.23456789, duration_s=0.1 + 0.2)
        again = row_of(csv_fields(csv_line(fields_of(row))), [NOISE])
        assert again == row._replace(wall_time_s=1.235)


def test_what_there_is_none_of_is_empty(campaign):
    row = row_of_job(
        campaign,
        campaign.trials()[0],
        outcome=Outcome.ABORTED,
        errors={PoseSource.ODOM: None, PoseSource.AMCL: None, PoseSource.WORLD: (0.0, 1.0, 2.0)},
    )
    fields = dict(zip(header([NOISE]), fields_of(row)))
    assert (fields['odom_x_m'], fields['global_yaw_rad'], fields['world_y_m']) == ('', '', '1.0')
    assert row_of(list(fields.values()), [NOISE]).errors == {
        PoseSource.ODOM: None,
        PoseSource.AMCL: None,
        PoseSource.GLOBAL: None,
        PoseSource.WORLD: (0.0, 1.0, 2.0),
    }


@pytest.mark.parametrize(
    'reason', ['a, "quoted" one', 'two\nlines\r\n', 'nul\0 tab\t esc\x1b \x85\u2028', 'größer', "'", '\udc80']
)
def test_whatever_the_reason_says_the_row_stays_a_line(campaign, reason):
    row = row_of_job(campaign, campaign.trials()[0], outcome=Outcome.LOST, reason=reason)
    line = csv_line(fields_of(row))
    assert line.count(b'\n') == 1 and len(line.splitlines()) == 1 and b'\0' not in line
    assert row_of(csv_fields(line), [NOISE]).identity() == row.identity()
