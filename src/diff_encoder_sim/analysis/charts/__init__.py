"""Charts with Altair as functions of DataFrames: interactive on offline pages, and as files."""
