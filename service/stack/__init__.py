"""All of an installation on one machine, started and supervised by one process."""

from service.stack.stack import Stack

__all__ = ["Stack"]
