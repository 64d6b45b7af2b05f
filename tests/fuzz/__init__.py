"""Damage done to valid files at random, and what must hold of whatever comes of it."""
