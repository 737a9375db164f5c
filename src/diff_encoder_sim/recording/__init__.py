"""Bags: which topics a trial records, and reading them back."""
