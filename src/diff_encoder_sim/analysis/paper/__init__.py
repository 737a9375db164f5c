"""What is the source paper's alone: its cells, claims and errata, beside our results."""
