"""report.html: one file that any browser opens, offline, with the summary first."""

from diff_encoder_sim.analysis.report.page import write_report

__all__ = ['write_report']
