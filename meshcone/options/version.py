"""Which options this program knows."""

OPTIONS_VERSION = 12
"""Goes up with each option that is added and each value that an option newly takes.

A worker leaves a job that was sent to a program with a higher one to a worker that knows it.
Jobs from before there were versions count as 0.
"""
