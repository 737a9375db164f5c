"""What an encoder node can say about its work, for /diagnostics."""

from __future__ import annotations

from diff_encoder_sim.wheels.count_rate import CountRate
from diff_encoder_sim.wheels.diagnosis import Diagnosis
from diff_encoder_sim.wheels.encoder_sample import EncoderSample


class EncoderDiagnosis:
    """Watches the reports of an encoder, and the joint messages that it has dropped."""

    def __init__(self, counter_modulus: int) -> None:
        self._rate = CountRate(counter_modulus)
        self._dropped = self._told = 0

    def take_report(self, sample: EncoderSample) -> None:
        """Take note of a report."""
        self._rate.take(*sample[:3])

    def take_fault(self) -> None:
        """Take note of a joint message that was dropped."""
        self._dropped += 1

    def diagnose(self) -> Diagnosis:
        """Return the state; a warning is of what has happened since the last call."""
        dropped, self._told = self._dropped - self._told, self._dropped
        left, right = self._rate.counts_per_s
        values = {
            'counts per second, left': left,
            'counts per second, right': right,
            'reports per second': self._rate.reports_per_s,
            'dropped joint messages': self._dropped,
        }
        return Diagnosis(f'dropped joint messages: {dropped}' if dropped else '', values)
