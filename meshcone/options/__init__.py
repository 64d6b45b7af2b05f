"""What a caller can ask of the engine, with every default in one place.

The models are the single source for the command line's ``--set``, the HTTP API's
``options`` field and the ``options`` section of the report. Distances are relative
to the reference's radius (the unit sphere of the paper) unless a field says otherwise.
"""

from meshcone.options.cones import ConeOptions, EdgeCapOptions, Length, PinOptions
from meshcone.options.deviation import DeviationOptions
from meshcone.options.everything import WITHIN_GATE, Formulation, Mode, Options
from meshcone.options.files import SelectOptions
from meshcone.options.program import CentroidOptions, SolverOptions, SurfaceOptions
from meshcone.options.quality import QualityOptions
from meshcone.options.reading import (
    parse_assignments,
    parse_options,
    parse_options_json,
    read_options_json,
)
from meshcone.options.tolerance import Tolerance
from meshcone.options.version import OPTIONS_VERSION

__all__ = [
    "OPTIONS_VERSION",
    "WITHIN_GATE",
    "CentroidOptions",
    "ConeOptions",
    "DeviationOptions",
    "EdgeCapOptions",
    "Formulation",
    "Length",
    "Mode",
    "Options",
    "PinOptions",
    "QualityOptions",
    "SelectOptions",
    "SolverOptions",
    "SurfaceOptions",
    "Tolerance",
    "parse_assignments",
    "parse_options",
    "parse_options_json",
    "read_options_json",
]
