"""Schemas of Khronos' glTF Asset Auditor, as gates.

Such a schema says which checks are made and what passes. What it leaves out has the default of
the auditor's version 1.0.0; -1 or false turns a check off.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from meshcone.errors import InputError
from meshcone.gates.files import GateFile, parse_gates, read_document
from meshcone.options import Mode
from meshcone.suggestions import did_you_mean, first_cause, in_words

_KILOBYTE = 1024
# Texels at the edges of triangles are counted for both of them, which is up to 0.02 %.
_OVERLAP = 0.001
_GUTTER_AT = 1024  # texels along a side that gutters are found at
_GUTTERS = (256, 512, 1024, 2048, 4096)

Document = TypeVar("Document", bound=BaseModel)
_Number = Annotated[float, Field(ge=-1, le=1e12, allow_inf_nan=False)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Range(_Part):
    minimum: _Number = -1
    maximum: _Number = -1


class _Kilobytes(_Range):
    minimum: _Number = 1
    maximum: _Number = 5120


class _AtMostFive(_Range):
    maximum: _Number = 5


class _Triangles(_Range):
    maximum: _Number = 100_000


class _Texels(_Range):
    minimum: _Number = 512
    maximum: _Number = 2048


class _Luminance(_Range):
    minimum: _Number = 30
    maximum: _Number = 243


class _Dimension(_Range):
    percentTolerance: _Number = -1


class _Dimensions(_Part):
    height: _Dimension = _Dimension()
    length: _Dimension = _Dimension()
    width: _Dimension = _Dimension()


class _Product(_Part):
    dimensions: _Dimensions = _Dimensions()


class _Objects(_Part):
    nodes: _Range = _Range()
    meshes: _Range = _Range()
    primitives: _Range = _Range()


class _Model(_Part):
    objectCount: _Objects = _Objects()
    requireBeveledEdges: bool = False
    requireCleanRootNodeTransform: bool = False
    requireManifoldEdges: bool = False
    triangles: _Triangles = _Triangles()


class _Textures(_Part):
    height: _Texels = _Texels()
    width: _Texels = _Texels()
    pbrColorRange: _Luminance = _Luminance()
    requireDimensionsBePowersOfTwo: bool = True
    requireDimensionsBeQuadratic: bool = False


class _Gutters(_Part):
    resolution256: _Number = -1
    resolution512: _Number = -1
    resolution1024: _Number = -1
    resolution2048: _Number = -1
    resolution4096: _Number = -1


class _Uvs(_Part):
    gutterWidth: _Gutters = _Gutters()
    requireNotInverted: bool = True
    requireNotOverlapping: bool = True
    requireRangeZeroToOne: bool = False
    pixelsPerMeter: _Range = _Range()


class _Schema(_Part):
    version: str
    fileSizeInKb: _Kilobytes = _Kilobytes()
    materials: _AtMostFive = _AtMostFive()
    model: _Model = _Model()
    product: _Product = _Product()
    textures: _Textures = _Textures()
    uvs: _Uvs = _Uvs()


class _Sizes(_Part):
    height: Annotated[float, Field(gt=0, le=1e12)]
    length: Annotated[float, Field(gt=0, le=1e12)]
    width: Annotated[float, Field(gt=0, le=1e12)]


class _ProductInfo(_Part):
    dimensions: _Sizes


def gates_of_schema(
    schema: tuple[str, bytes], product: tuple[str, bytes] | None, mode: Mode
) -> GateFile:
    """The gates that a schema of the auditor amounts to.

    Args:
        schema: name and bytes of the JSON file.
        product: likewise of the file with the product's dimensions, in model units.
        mode: what the gates are for.

    Raises:
        InputError: one of them says what the auditor does not know, or the schema asks for
            tolerances and there is no product.
    """
    read = _validated(_Schema, *schema)
    sizes = None if product is None else _validated(_ProductInfo, *product).dimensions
    gates = dict(_gates(read)) | dict(_sizes(read.product.dimensions, sizes, schema[0]))
    return parse_gates({"gates": gates}, mode, schema[0])


def _validated(model: type[Document], name: str, data: bytes) -> Document:
    try:
        return model.model_validate(read_document(name, data))
    except ValidationError as error:
        first = first_cause(error)
        path = ".".join(map(str, first["loc"])) or "the document"
        if first["type"] == "extra_forbidden":
            known = list(_names(model))
            raise InputError(
                f"unknown key '{path}'{did_you_mean(path, known)}", file=name
            ) from None
        raise InputError(f"'{path}': {in_words(first)}", file=name) from None


def _names(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    for name, field in model.model_fields.items():
        yield prefix + name
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from _names(field.annotation, f"{prefix}{name}.")


def _gates(schema: _Schema) -> Iterator[tuple[str, dict[str, Any]]]:
    model, textures, uvs = schema.model, schema.textures, schema.uvs
    ranges = {
        "budget.total_bytes": (schema.fileSizeInKb, _KILOBYTE),
        "budget.materials": (schema.materials, 1),
        "budget.nodes": (model.objectCount.nodes, 1),
        "budget.meshes": (model.objectCount.meshes, 1),
        "budget.draw_calls": (model.objectCount.primitives, 1),
        "budget.triangles": (model.triangles, 1),
    }
    for name, (bounds, unit) in ranges.items():
        yield from _bounded(name, name, bounds, unit)
    for side, bounds in (("width", textures.width), ("height", textures.height)):
        yield from _bounded(f"textures.smallest_{side}", f"textures.largest_{side}", bounds)
    luminance = "textures.base_color_luminance"
    yield from _bounded(f"{luminance}_min", f"{luminance}_max", textures.pbrColorRange)
    yield from _bounded("uv.texel_density_min", "uv.texel_density_max", uvs.pixelsPerMeter)
    none: dict[str, Any] = {"max": 0.0}
    required: list[tuple[bool, str, dict[str, Any]]] = [
        (model.requireBeveledEdges, "geometry.sharp_edges", none),
        (model.requireCleanRootNodeTransform, "size.clean_root", {"equals": True}),
        (model.requireManifoldEdges, "geometry.watertight", {"equals": True}),
        (textures.requireDimensionsBePowersOfTwo, "textures.not_power_of_two", none),
        (textures.requireDimensionsBeQuadratic, "textures.not_square", none),
        (uvs.requireNotInverted, "uv.inverted_share", none),
        (uvs.requireNotOverlapping, "uv.overlap_share", {"max": _OVERLAP}),
        (uvs.requireRangeZeroToOne, "uv.outside", none),
    ]
    yield from ((f"asset.{name}", rule) for asked, name, rule in required if asked)
    gutters = [(size, getattr(uvs.gutterWidth, f"resolution{size}")) for size in _GUTTERS]
    widths = [ceil(_GUTTER_AT * texels / size) for size, texels in gutters if texels > 0]
    if widths:  # of several, the auditor takes the smallest grid, which is the widest gutter
        yield "asset.uv.gutter", {"min": float(max(widths))}


def _bounded(
    low: str, high: str, bounds: _Range, unit: float = 1
) -> Iterator[tuple[str, dict[str, float]]]:
    """Gates for both ends of a range, on one value or on the least and the greatest of several."""
    least = {"min": bounds.minimum * unit} if bounds.minimum >= 0 else {}
    most = {"max": bounds.maximum * unit} if bounds.maximum >= 0 else {}
    found = {low: {**least, **most}} if low == high else {low: least, high: most}
    yield from ((f"asset.{name}", rule) for name, rule in found.items() if rule)


def _sizes(
    dimensions: _Dimensions, product: _Sizes | None, name: str
) -> Iterator[tuple[str, dict[str, float]]]:
    """Bounds on the box: those of the schema, and those of the product with its tolerance."""
    axes = {"height": "height", "length": "depth", "width": "width"}  # y is up in a glTF
    for side, axis in axes.items():
        wanted: _Dimension = getattr(dimensions, side)
        lows, highs = [wanted.minimum], [wanted.maximum]
        if wanted.percentTolerance >= 0:
            if product is None:
                raise InputError(
                    f"it has a tolerance for the product's {side}: name the product's dimensions "
                    "by --product",
                    file=name,
                )
            size = getattr(product, side)
            lows.append(size * (1 - wanted.percentTolerance / 100))
            highs.append(size * (1 + wanted.percentTolerance / 100))
        rule = {}
        if (least := max(lows)) >= 0:
            rule["min"] = least
        if allowed := [each for each in highs if each >= 0]:
            rule["max"] = min(allowed)
        if rule:
            yield f"asset.size.{axis}", rule
