"""Tables as their CSV files read back."""

import csv
import io

from diff_encoder_sim.analysis.table_files import csv_text


def records(table):
    """Its CSV file, read back."""
    return list(csv.DictReader(io.StringIO(csv_text(table))))


def column(table, name, key='statistic'):
    return {row[key]: float(row[name]) if row[name] else None for row in records(table)}
