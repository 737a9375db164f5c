"""What the encoder node says on /diagnostics."""

from diff_encoder_sim.wheels.diagnostics import EncoderDiagnosis
from diff_encoder_sim.wheels.report_link import EncoderSample


def test_counts_and_reports_per_second_and_what_was_dropped():
    diagnosis = EncoderDiagnosis(256)
    for index in range(41):
        diagnosis.take_report(EncoderSample(index * 50_000_000, (5 * index + 128) % 256 - 128, -index))
    assert diagnosis.diagnose() == (
        '',
        {
            'counts per second, left': 100.0,
            'counts per second, right': -20.0,
            'reports per second': 20.0,
            'dropped joint messages': 0,
        },
    )


def test_dropped_messages_are_warned_of_once_and_stay_counted():
    diagnosis = EncoderDiagnosis(0)
    diagnosis.take_fault()
    diagnosis.take_fault()
    assert diagnosis.diagnose().warning == 'dropped joint messages: 2'
    warning, values = diagnosis.diagnose()
    assert warning == '' and values['dropped joint messages'] == 2
