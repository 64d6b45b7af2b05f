"""Loaded by each Python process that is to be older: it knows no version of the options.

Python imports a module of this name at its start if its folder is in PYTHONPATH.
"""

from meshcone import options

options.OPTIONS_VERSION = 0
