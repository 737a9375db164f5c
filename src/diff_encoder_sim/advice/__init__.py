"""Which encoder a robot needs."""
