"""Where a source has too few faces for its reference, and how they are divided."""
