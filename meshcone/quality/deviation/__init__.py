"""Proven intervals for how far one surface goes from another, and what re-proves them."""
