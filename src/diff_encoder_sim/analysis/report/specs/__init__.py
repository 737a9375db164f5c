"""The report's charts as Vega-Lite specifications; `setup`, `encoders`, ... are what its reader has chosen."""
