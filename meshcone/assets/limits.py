"""How much of a file is accepted, decided before memory is spent on it."""

from __future__ import annotations

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from meshcone.errors import LimitError

# Far beyond any unit of length, and small enough that areas and volumes do not overflow.
LARGEST_COORDINATE = 1e60

_MIB = 1024 * 1024


class Limits(BaseSettings):
    """Caps on one asset, each settable as ``MESHCONE_LIMIT_<NAME>`` in the environment.

    The defaults let a mesh of a million vertices with normals and texture coordinates
    through in either format, which a job has the memory to refine (``docs/deployment.md`` has
    the figures). They bound what the smallest of pieces can add up to: a file of nothing but
    line ends or empty chunks needs many times its size in memory. A glTF and the files it
    names count as one asset.
    """

    model_config = SettingsConfigDict(
        env_prefix="MESHCONE_LIMIT_",
        env_ignore_empty=True,  # an empty variable is how a compose file says "not set"
        frozen=True,
        extra="ignore",
    )

    file_bytes: int = Field(256 * _MIB, ge=1, description="the file and its resources together")
    vertices: int = Field(1_000_000, ge=1, description="vertices as the file stores them")
    faces: int = Field(2_000_000, ge=1, description="triangles, after polygons are split")
    lines: int = Field(
        12_000_000,
        ge=1,
        description="lines of a text format; numbers in rows of different lengths in a binary PLY",
    )
    convert_seconds: int = Field(
        60, ge=1, description="seconds of reading a STEP, 3MF or USD, in a process of its own"
    )
    convert_memory_bytes: int = Field(
        2048 * _MIB, ge=512 * _MIB, description="memory of that process, its reader included"
    )
    archive_files: int = Field(10_000, ge=1, description="files and folders in a ZIP archive")
    archive_ratio: int = Field(
        200,
        ge=1,
        description="unpacked size of a ZIP archive over its own, where it is more than 16 MiB",
    )
    header_bytes: int = Field(65_536, ge=1, description="header of a PLY")
    json_bytes: int = Field(128 * _MIB, ge=1, description="JSON text of a glTF, data URIs included")
    json_depth: int = Field(64, ge=1, description="nested arrays and objects in a glTF")
    json_values: int = Field(
        4_000_000, ge=1, description="values in a glTF's JSON: numbers, strings, arrays, objects"
    )
    chunks: int = Field(1_000, ge=2, description="chunks in a GLB")
    nodes: int = Field(100_000, ge=1, description="nodes in a glTF")
    node_depth: int = Field(256, ge=1, description="levels of a glTF's node tree")
    accessors: int = Field(100_000, ge=1, description="accessors in a glTF")
    meshes: int = Field(
        100_000, ge=1, description="meshes in a glTF, primitives in all of them, and draws of these"
    )

    def check(self, name: str, found: int, what: str, place: str | None = None) -> None:
        """Compare a declared or counted size with the cap called ``name``.

        Raises:
            LimitError: naming what was found, the cap and the setting that moves it.
        """
        allowed = getattr(self, name)
        if found > allowed:
            setting = f"MESHCONE_LIMIT_{name.upper()}"
            raise LimitError(
                f"{found:,} {what}; this installation accepts {allowed:,} ({setting})", place=place
            )
