"""Charts as functions of DataFrames, by Altair: interactive in pages that any browser opens offline, and as files."""
