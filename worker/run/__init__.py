"""One attempt at a job: the worker takes a message, its horse does the work."""
