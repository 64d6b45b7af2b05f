"""Steps that are taken at the broker's memory limit too.

A broker at its limit refuses a script before its first write, unless the script says that it may
run. Those say so that free memory, that end something, or that lead there: without them nothing
would ever make room.
"""

WHEN_FULL = "#!lua flags=allow-oom\n"
"""The first line of such a script."""
