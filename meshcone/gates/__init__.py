"""Bounds on a report's numbers, and the verdict they lead to."""
