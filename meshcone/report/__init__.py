"""The report: its models, scores, outcome and warnings about the data."""
