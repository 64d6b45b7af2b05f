"""ZIP archives with a mesh and the files it names."""

from meshcone.assets.archive.choice import Packed, unpack
from meshcone.assets.archive.directory import is_archive, read_directory

__all__ = ["Packed", "is_archive", "read_directory", "unpack"]
