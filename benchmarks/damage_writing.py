"""An asset of damage_model.py as OBJ, glTF or GLB, as exporters write it."""

from __future__ import annotations

import base64
import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from damage_model import Floats, Model, Part, Surface
from numpy.typing import NDArray

_COMPONENTS = {"<f4": 5126, "<u2": 5123, "<u4": 5125, "|u1": 5121, "|i1": 5120}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_EYE = {"name": "eye", "type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}
_LAMP = {"name": "lamp", "type": "point"}


def to_obj(model: Model) -> tuple[bytes, dict[str, bytes]]:
    """An OBJ, and the library and images beside it; without what an OBJ cannot hold."""
    lines = ["mtllib pot.mtl"] if model.library else []
    counts = np.zeros(3, dtype=int)
    for part in model.parts:
        lines += [f"o {part.name}"]
        for word, rows in (
            ("v", part.positions + part.place + model.root),
            ("vt", part.uvs),
            ("vn", part.normals),
        ):
            for row in () if rows is None else rows:
                lines.append(f"{word} " + " ".join(f"{value:.9g}" for value in row))
        lines.append(f"usemtl {model.surfaces[part.material].name}")
        own = [None if each is None else 1 for each in (part.positions, part.uvs, part.normals)]
        for face in part.faces:
            corners = (
                "/".join(
                    "" if has is None else str(vertex + 1 + start)
                    for has, start in zip(own, counts, strict=True)
                )
                for vertex in face
            )
            lines.append("f " + " ".join(each.rstrip("/") for each in corners))
        for number, rows in enumerate((part.positions, part.uvs, part.normals)):
            counts[number] += 0 if rows is None else len(rows)
    beside = {"pot.mtl": _library(model)} if model.library else {}
    beside |= {f"image{n}.png": data for n, data in enumerate(model.images) if data is not None}
    return ("\n".join(lines) + "\n").encode(), beside


def _library(model: Model) -> bytes:
    lines = []
    for surface in model.surfaces:
        lines += [
            f"newmtl {surface.name}",
            "Kd " + " ".join(f"{value:.6g}" for value in surface.color[:3]),
            f"d {surface.color[3]:.6g}",
            f"Pr {surface.roughness:.6g}",
        ]
        if surface.base is not None:
            lines.append(f"map_Kd image{surface.base}.png")
        if surface.normal is not None:
            lines.append(f"norm image{surface.normal}.png")
    return ("\n".join(lines) + "\n").encode()


class Store:
    """A growing buffer with accessors into it."""

    def __init__(self, *, reverse: bool = False) -> None:
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self._pieces: list[bytes] = []
        self._reverse = reverse

    def add(self, values: NDArray[Any], kind: str, *, tight: bool = False, **members: Any) -> int:
        """Store rows of numbers as this type, each at a multiple of four bytes unless tight."""
        rows = np.ascontiguousarray(values, dtype=kind).reshape(len(values), -1)
        width = rows.itemsize * rows.shape[1]
        padded = np.zeros((len(rows), -(-width // 4) * 4), dtype=np.uint8)
        padded[:, :width] = np.frombuffer(rows.tobytes(), np.uint8).reshape(len(rows), width)
        view = self.view((rows if tight else padded).tobytes())
        if not tight and padded.shape[1] != width:
            self.views[view]["byteStride"] = padded.shape[1]
        bounds = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(
            {
                "bufferView": view,
                "componentType": _COMPONENTS[rows.dtype.str],
                "count": len(rows),
                "type": _KINDS[rows.shape[1]],
            }
            | (bounds if np.isfinite(rows).all() else {})
            | members
        )
        return len(self.accessors) - 1

    def view(self, data: bytes) -> int:
        """Store bytes; their view."""
        self._pieces.append(data + bytes(-len(data) % 4))
        self.views.append({"buffer": 0, "byteLength": len(data)})
        return len(self.views) - 1

    def buffer(self) -> bytes:
        """All bytes, in one order or the other, with the views set to where they are."""
        order = list(range(len(self._pieces)))
        data = b""
        for number in reversed(order) if self._reverse else order:
            self.views[number]["byteOffset"] = len(data)
            data += self._pieces[number]
        return data


@dataclass(frozen=True)
class Style:
    """How an exporter writes the same asset."""

    binary: bool = False
    wide: bool = True
    reverse: bool = False
    shuffled: bool = False
    quantised: bool = False


def to_gltf(model: Model, style: Style | None = None) -> bytes:
    """The asset as a glTF or GLB in one file."""
    style = style or Style()
    store = Store(reverse=style.reverse)
    document = _Exporter(model, style, store).document()
    buffer = store.buffer()
    document |= {"accessors": store.accessors, "bufferViews": store.views}
    document["buffers"] = [{"byteLength": len(buffer)}]
    if style.binary:
        return _glb(document, buffer)
    data = base64.b64encode(buffer).decode()
    document["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{data}"
    return json.dumps(document).encode()


def _glb(document: dict[str, Any], buffer: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(buffer), 0x004E4942) + buffer
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


@dataclass
class _Exporter:
    """Writes a model's things one after the other."""

    model: Model
    style: Style
    store: Store
    extensions: set[str] = field(default_factory=set)

    def document(self) -> dict[str, Any]:
        nodes = self._nodes()
        found = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"name": "shelf", "nodes": self._roots(nodes)}],
            "nodes": nodes,
            "meshes": [self._mesh(part) for part in self.model.parts],
            "materials": [self._material(surface) for surface in self.model.surfaces],
            "textures": [{"source": number} for number in range(len(self.model.images))],
            "images": [self._image(number) for number in range(len(self.model.images))],
            "cameras": [_EYE] if self.model.camera else [],
            "skins": [self._skin(nodes)] if self.model.bound else [],
            "animations": [self._animation(nodes)] if self.model.animation else [],
        }
        if self.model.light:
            self.extensions.add("KHR_lights_punctual")
            found["extensions"] = {
                "KHR_lights_punctual": {"lights": [{"name": "lamp", "type": "point"}]}
            }
        found["extensionsUsed"] = sorted(self.extensions)
        if self.style.quantised:
            found["extensionsRequired"] = ["KHR_mesh_quantization"]
        return {name: value for name, value in found.items() if value != []}

    def _nodes(self) -> list[dict[str, Any]]:
        model = self.model
        nodes: list[dict[str, Any]] = []
        for number, part in enumerate(model.parts):
            node: dict[str, Any] = {"name": part.name, "mesh": number}
            if any(part.place):
                node["translation"] = list(part.place)
            if part.joints is not None and model.bound:
                node["skin"] = 0
            nodes.append(node)
        stand = {
            "name": "stand",
            "children": [n for n, part in enumerate(model.parts) if part.parent == "stand"],
        }
        if any(model.root):
            stand["translation"] = model.root
        if model.extras:
            stand["extras"] = model.extras
        nodes += [stand] if stand["children"] else []
        first = len(nodes)
        nodes += [{"name": name} for name in model.joints]
        if len(model.joints) > 1:
            nodes[first]["children"] = [first + 1]
        if model.camera:
            nodes.append({"name": "eye", "camera": 0, "translation": [0, 1, 5]})
        if model.light:
            nodes.append({"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}})
        return nodes

    def _roots(self, nodes: list[dict[str, Any]]) -> list[int]:
        below = {child for node in nodes for child in node.get("children", ())}
        return [number for number in range(len(nodes)) if number not in below]

    def _mesh(self, part: Part) -> dict[str, Any]:
        order = np.arange(len(part.positions))
        if self.style.shuffled:
            order = np.random.default_rng(1).permutation(order)
        attributes = {"POSITION": self.store.add(part.positions[order], "<f4")}
        faces = np.argsort(order)[part.faces]
        if self.style.shuffled:
            faces = np.roll(np.random.default_rng(2).permutation(faces), 1, axis=1)
        if part.normals is not None:
            attributes["NORMAL"] = self._directions(part.normals[order])
        if part.uvs is not None:
            attributes["TEXCOORD_0"] = self._uvs(part.uvs[order])
        if part.colors is not None:
            attributes["COLOR_0"] = self.store.add(part.colors[order], "<f4")
        if part.joints is not None and part.weights is not None and self.model.bound:
            attributes["JOINTS_0"] = self.store.add(part.joints[order], "|u1")
            attributes["WEIGHTS_0"] = self.store.add(part.weights[order], "<f4")
        primitive = {
            "attributes": attributes,
            "indices": self.store.add(
                faces.reshape(-1, 1), "<u4" if self.style.wide else "<u2", tight=True
            ),
            "material": part.material,
        }
        mesh: dict[str, Any] = {"name": part.name, "primitives": [primitive]}
        if part.target is not None:
            primitive["targets"] = [{"POSITION": self.store.add(part.target[order], "<f4")}]
            mesh |= {"weights": [0.0], "extras": {"targetNames": ["open"]}}
        return mesh

    def _directions(self, directions: Floats) -> int:
        if not self.style.quantised:
            return self.store.add(directions, "<f4")
        self.extensions.add("KHR_mesh_quantization")
        return self.store.add(np.rint(directions * 127), "|i1", normalized=True)

    def _uvs(self, uvs: Floats) -> int:
        if not self.style.quantised:
            return self.store.add(uvs, "<f4")
        return self.store.add(np.rint(uvs * 65535), "<u2", normalized=True)

    def _material(self, surface: Surface) -> dict[str, Any]:
        metallic: dict[str, Any] = {
            "baseColorFactor": surface.color,
            "metallicFactor": 0.0,
            "roughnessFactor": surface.roughness,
        }
        found: dict[str, Any] = {"name": surface.name, "pbrMetallicRoughness": metallic}
        if surface.base is not None:
            metallic["baseColorTexture"] = {"index": surface.base}
        if surface.normal is not None:
            found["normalTexture"] = {"index": surface.normal}
        if surface.alpha != "OPAQUE":
            found["alphaMode"] = surface.alpha
        if surface.double_sided:
            found["doubleSided"] = True
        if surface.ior is not None:
            self.extensions.add("KHR_materials_ior")
            found["extensions"] = {"KHR_materials_ior": {"ior": surface.ior}}
        return found

    def _image(self, number: int) -> dict[str, Any]:
        data = self.model.images[number]
        if data is None:
            return {"uri": f"image{number}.png"}
        return {
            "name": f"image{number}",
            "bufferView": self.store.view(data),
            "mimeType": "image/png",
        }

    def _skin(self, nodes: list[dict[str, Any]]) -> dict[str, Any]:
        names = [node["name"] for node in nodes]
        binds = np.tile(np.eye(4).ravel(), (len(self.model.joints), 1))
        return {
            "name": "rig",
            "joints": [names.index(name) for name in self.model.joints],
            "inverseBindMatrices": self.store.add(binds, "<f4"),
        }

    def _animation(self, nodes: list[dict[str, Any]]) -> dict[str, Any]:
        names = [node["name"] for node in nodes]
        times = self.store.add(self.model.times.reshape(-1, 1), "<f4", tight=True)
        samplers, channels = [], []
        for values, node, path in (
            (self.model.turns, self.model.joints[-1] if self.model.joints else "", "rotation"),
            (self.model.lifts, "lid", "weights"),
        ):
            if values is None or node not in names:
                continue
            rows = values.reshape(len(values), -1)
            channels.append(
                {"sampler": len(samplers), "target": {"node": names.index(node), "path": path}}
            )
            samplers.append({"input": times, "output": self.store.add(rows, "<f4", tight=True)})
        return {"name": self.model.animation, "samplers": samplers, "channels": channels}
