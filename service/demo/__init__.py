"""The demonstration: an asset of its own, refined by a real service, with pictures."""
