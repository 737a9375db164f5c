"""report.html: one file that any browser opens, offline, with the summary first."""
