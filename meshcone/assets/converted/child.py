"""Turns a file of a design program into a GLB, in a process of its own.

Started by file name with the name of a format, so that it imports nothing but the reader of that
format and NumPy. It reads on standard input the bytes of memory and the seconds it may take, the
chord tolerance (0 to choose one) and the file; and writes to standard output how it went (one
byte), the tolerance that was kept, and a GLB, or why not.
"""

import json
import math
import os
import struct
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

HEAD = struct.Struct("<QQd")
ANSWER = struct.Struct("<Bd")
DONE, REFUSED, OUT_OF_MEMORY = range(3)
# Of half the diagonal, where nothing is asked for.
_DEFAULT_CHORD = 5e-4
# The reader goes beyond the chord it is given: by a third on a sphere.
_SAFETY = 0.5
_ANGLE = 0.5  # radians between neighbouring normals, whatever the chord
_COARSE = 1e9

_UNSEEN = ("guide", "proxy")  # purposes that viewers do not show
_SCRATCH_BYTES = 1 << 30  # the readers write files, and remove them

_Part = tuple[str, Any, Any, Any]  # name, (4, 4) matrix, (n, 3) positions, (m, 3) faces


class _RefusedError(Exception):
    """The file cannot be used; the words say why."""


def main() -> int:
    """Convert the file."""
    # Readers print what they think of a file; the answer has the place they print to for itself.
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    source = sys.stdin.buffer
    memory, seconds, chord = HEAD.unpack(source.read(HEAD.size))
    data = source.read()
    convert: Callable[[bytes, float], tuple[bytes, float]]
    convert = {"step": _step, "3mf": _three_mf, "usd": _usd, "usdz": _usd}[sys.argv[1]]
    _limit(memory, seconds)
    status, kept = DONE, 0.0
    try:
        found, kept = convert(data, chord)
    except MemoryError:
        status, found = OUT_OF_MEMORY, b""
    except _RefusedError as error:
        status, found = REFUSED, str(error).encode()
    with answer:
        answer.write(ANSWER.pack(status, kept) + found)
    return 0


def _step(data: bytes, chord: float) -> tuple[bytes, float]:
    """Tessellate boundary representations with OpenCASCADE; lengths are millimetres."""
    import cascadio

    def tessellated(linear: float, angular: float) -> bytes:
        found: bytes = cascadio.load(
            data, "step", tol_linear=linear, tol_angular=angular, use_parallel=False
        )
        if not found:
            raise _RefusedError("it is damaged, or holds no shape with a surface")
        return found

    kept = chord or 1e3 * _half_diagonal(tessellated(_COARSE, 1.5)) * _DEFAULT_CHORD
    return tessellated(_SAFETY * kept, _ANGLE), kept


def _half_diagonal(glb: bytes) -> float:
    """Half the diagonal of what a GLB's meshes span, each where it is modelled."""
    (length,) = struct.unpack_from("<I", glb, 12)
    document = json.loads(glb[20 : 20 + length])
    bounds = [each for each in document.get("accessors", ()) if "min" in each and "max" in each]
    spans = [math.dist(each["min"], each["max"]) for each in bounds if each.get("type") == "VEC3"]
    if not spans:
        raise _RefusedError("it holds no shape with a surface")
    return max(spans) / 2


def _three_mf(data: bytes, _chord: float) -> tuple[bytes, float]:
    """Collect the meshes of a 3MF where its build items put them."""
    import lib3mf
    import numpy as np

    wrapper = lib3mf.get_wrapper()
    model = wrapper.CreateModel()
    reader = model.QueryReader("3mf")
    try:
        reader.ReadFromBuffer(bytearray(data))
    except lib3mf.ELib3MFException as error:
        raise _RefusedError(f"it is damaged: {error}") from None

    def matrix_of(transform: Any) -> Any:
        matrix = np.eye(4)
        matrix[:3, :] = np.array([list(row) for row in transform.Fields]).T
        return matrix

    def parts_of(item: Any, matrix: Any, depth: int) -> Iterable[_Part]:
        if depth > 32:
            raise _RefusedError("its components are nested more than 32 deep")
        if item.IsMeshObject():
            mesh = model.GetMeshObjectByID(item.GetResourceID())
            points = np.array([list(each.Coordinates) for each in mesh.GetVertices()])
            corners = np.array([list(each.Indices) for each in mesh.GetTriangleIndices()])
            if len(corners):
                yield item.GetName(), matrix, points, corners
        elif item.IsComponentsObject():
            whole = model.GetComponentsObjectByID(item.GetResourceID())
            for number in range(whole.GetComponentCount()):
                part = whole.GetComponent(number)
                below = matrix_of(part.GetTransform()) if part.HasTransform() else np.eye(4)
                yield from parts_of(part.GetObjectResource(), matrix @ below, depth + 1)

    parts: list[_Part] = []
    items = model.GetBuildItems()
    while items.MoveNext():
        item = items.GetCurrent()
        matrix = matrix_of(item.GetObjectTransform()) if item.HasObjectTransform() else np.eye(4)
        parts += parts_of(item.GetObjectResource(), matrix, 0)
    return _glb(parts), 0.0


def _usd(data: bytes, _chord: float) -> tuple[bytes, float]:
    """Collect the meshes that a USD stage shows, in metres and with y up where it says which."""
    from pxr import Tf

    place = f"scene.{'usdz' if data.startswith(b'PK') else 'usd'}"
    Path(place).write_bytes(data)
    try:
        return _glb(_usd_parts(place)), 0.0
    except Tf.ErrorException as error:
        words = str(error).rpartition(" : ")[2].strip(" '\n").replace(f"{Path.cwd()}/", "")
        raise _RefusedError(f"it is damaged: {words[:200]}") from None


def _usd_parts(place: str) -> list[_Part]:
    import numpy as np
    from pxr import Usd, UsdGeom

    layers = _require_whole(place)
    stage = Usd.Stage.Open(layers[0])
    whole = np.eye(4)
    if stage.HasAuthoredMetadata("upAxis") and UsdGeom.GetStageUpAxis(stage) == "Z":
        whole[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    if UsdGeom.StageHasAuthoredMetersPerUnit(stage):
        # The schema says double, and some exporters write a float.
        whole[:3, :3] *= float(stage.GetMetadata("metersPerUnit"))
    time = Usd.TimeCode.EarliestTime()
    parts: list[_Part] = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)):
        if not prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.PointInstancer):
            continue
        shape = UsdGeom.Imageable(prim)
        if shape.ComputeVisibility(time) == "invisible" or shape.ComputePurpose() in _UNSEEN:
            continue
        if prim.IsA(UsdGeom.Mesh):
            world = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(time)).T
            parts += _usd_mesh(UsdGeom.Mesh(prim), whole @ world)
        elif not prim.IsA(UsdGeom.Curves) and not prim.IsA(UsdGeom.Points):
            kind = prim.GetTypeName()
            raise _RefusedError(f"'{prim.GetName()}' is a {kind}, and only meshes are read")
    return parts


def _require_whole(place: str) -> list[Any]:
    """Refuse what would have other files of this machine opened.

    Returns:
        The layers of the file, the root first. As long as they are held, a stage is composed of
        these, without what was taken out of them.
    """
    from pxr import Sdf

    layers = []
    waiting, known = [place], {place}
    while waiting:
        name = waiting.pop()
        layer = Sdf.Layer.FindOrOpen(name)
        if layer is None:
            inside = name.partition("[")[2].rstrip("]")
            raise _RefusedError(
                f"it lacks its file '{inside[:100]}'" if inside else "it is damaged"
            )
        layers.append(layer)
        for named in layer.GetCompositionAssetDependencies():
            if not named:  # a prim of the same file
                continue
            if named.lower().endswith(".mtlx"):  # MaterialX: looks alone
                layer.UpdateCompositionAssetDependency(named, "")
                continue
            other = Sdf.ComputeAssetPathRelativeToLayer(layer, named)
            if f"{place}[" not in other:
                raise _RefusedError(f"it is in several files, of which '{named[:100]}' is another")
            if other not in known:
                known.add(other)
                waiting.append(other)

        def require_no_clips(path: Any, layer: Any = layer) -> None:
            spec = layer.GetPrimAtPath(path) if path.IsPrimPath() else None
            if spec is not None and spec.HasInfo("clips"):
                raise _RefusedError("its values are in other files (clips)")

        layer.Traverse(Sdf.Path.absoluteRootPath, require_no_clips)
    return layers


def _usd_mesh(mesh: Any, matrix: Any) -> Iterable[_Part]:
    """A mesh, its polygons divided into fans; without those that are holes."""
    import numpy as np
    from pxr import Usd

    def values(attribute: Any, kind: str) -> Any:
        found = attribute.Get(Usd.TimeCode.EarliestTime())
        return np.array(found if found is not None else [], dtype=kind)

    points = values(mesh.GetPointsAttr(), "f8").reshape(-1, 3)
    counts = values(mesh.GetFaceVertexCountsAttr(), "i8")
    corners = values(mesh.GetFaceVertexIndicesAttr(), "i8")
    if not len(counts):
        return
    name = mesh.GetPrim().GetName()
    if counts.sum() != len(corners) or counts.min() < 0:
        raise _RefusedError(f"the faces of '{name}' do not have the corners that it lists")
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(points):
        raise _RefusedError(f"a face of '{name}' has a corner that is none of its points")
    holes = values(mesh.GetHoleIndicesAttr(), "i8")
    shown = np.ones(len(counts), dtype=bool)
    shown[holes[(holes >= 0) & (holes < len(counts))]] = False
    starts = np.cumsum(counts) - counts
    fans = np.where(shown, np.maximum(counts - 2, 0), 0)
    first = np.repeat(starts, fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    faces = corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]
    if mesh.GetOrientationAttr().Get() == "leftHanded":
        faces = faces[:, ::-1]
    if len(faces):
        yield name, matrix, points, faces


def _glb(parts: list[_Part]) -> bytes:
    """A GLB with a node for each part."""
    import numpy as np

    if not parts:
        raise _RefusedError("it holds no mesh with faces")
    document: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0}
    views: list[dict[str, int]] = []
    accessors: list[dict[str, Any]] = []
    chunks: list[bytes] = []

    def stored(values: Any, kind: str, component: int, **beside: Any) -> int:
        content = values.tobytes()
        start = sum(map(len, chunks))
        views.append({"buffer": 0, "byteOffset": start, "byteLength": len(content)})
        count = len(values)
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": component, "count": count, "type": kind}
            | beside
        )
        chunks.append(content)
        return len(accessors) - 1

    document["nodes"], document["meshes"] = [], []
    for name, matrix, positions, faces in parts:
        points = np.ascontiguousarray(positions, dtype="<f4")
        if not len(points) or not np.isfinite(points).all():
            raise _RefusedError(f"a vertex of '{name[:60]}' has no finite coordinates")
        bounds = {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        primitive = {
            "attributes": {"POSITION": stored(points, "VEC3", 5126, **bounds)},
            "indices": stored(faces.reshape(-1).astype("<u4"), "SCALAR", 5125),
        }
        mesh = len(document["meshes"])
        document["meshes"].append({"name": name, "primitives": [primitive]})
        document["nodes"].append({"name": name, "mesh": mesh, "matrix": matrix.T.ravel().tolist()})
    document["scenes"] = [{"nodes": list(range(len(parts)))}]
    binary = b"".join(chunks)
    document["buffers"] = [{"byteLength": len(binary)}]
    document["bufferViews"], document["accessors"] = views, accessors
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(binary), 0x004E4942) + binary


def _limit(memory: int, seconds: int) -> None:
    try:
        import resource
    except ImportError:  # not on Windows, where the caller's time limit is all there is
        return
    for which, most in (
        (resource.RLIMIT_AS, memory),
        (resource.RLIMIT_CPU, seconds),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_FSIZE, _SCRATCH_BYTES),
    ):
        _, highest = resource.getrlimit(which)
        bounded = most if highest == resource.RLIM_INFINITY else min(most, highest)
        resource.setrlimit(which, (bounded, bounded))  # may be more than the caller may itself


if __name__ == "__main__":
    sys.exit(main())
