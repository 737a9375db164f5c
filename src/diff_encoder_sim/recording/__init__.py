"""Bags: the topics that a trial records, writing them, and reading bags of any origin."""
