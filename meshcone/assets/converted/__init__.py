"""Formats of design programs, which other projects' readers turn into a GLB."""

from meshcone.assets.converted.asset import ConvertedAsset, read_converted
from meshcone.assets.converted.formats import SUFFIXES, recognise_converted

__all__ = ["SUFFIXES", "ConvertedAsset", "read_converted", "recognise_converted"]
