"""For `dask worker --preload`: a worker that sees no folder of the client's, as on another machine."""

from diff_encoder_sim.trials.results import ResultsFolder

ResultsFolder.is_shared = lambda self: False
