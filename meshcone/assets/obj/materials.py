"""The material libraries of an OBJ file.

Source: "MTL material format", Alias|Wavefront 1995, with the PBR statements that exporters
add to it (Clara.io, "Extending Wavefront MTL for physically based rendering", 2014). Colours
are taken as sRGB, as viewers show them; so are those of textures.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from meshcone.assets.comments import uncommented
from meshcone.assets.content import Image, Material, TextureUse
from meshcone.assets.content.faults import Faults
from meshcone.assets.content.records import Wrap
from meshcone.assets.obj.numbers import parse_number, shown
from meshcone.relative_names import inside, sent_as
from meshcone.srgb import to_linear
from meshcone.text import BYTE_ORDER_MARK

_SLOTS = {
    b"map_kd": "base_color",
    b"map_d": "alpha",
    b"map_ks": "specular",
    b"map_ka": "ambient",
    b"map_ke": "emissive",
    b"map_ns": "shininess",
    b"map_pr": "roughness",
    b"map_pm": "metallic",
    b"map_bump": "bump",
    b"bump": "bump",
    b"norm": "normal",
    b"map_norm": "normal",
    b"disp": "displacement",
    b"decal": "decal",
}
# How many words follow an option of a texture; -o, -s and -t take one to three numbers.
_OPTIONS = {
    b"-blendu": 1,
    b"-blendv": 1,
    b"-boost": 1,
    b"-bm": 1,
    b"-cc": 1,
    b"-clamp": 1,
    b"-imfchan": 1,
    b"-mm": 2,
    b"-texres": 1,
    b"-type": 1,
}
_VECTOR_OPTIONS = (b"-o", b"-s", b"-t")
_MOST_NUMBERS = 3
# Statements that are kept to be compared.
_MOST_PARAMETERS, _LETTERS, _MOST_TOLD = 100, 40, 80
_ROUNDING = 5  # decimals that exporters keep of a factor
_SPELLED = {key.lower().encode(): key for key in ("Ka", "Kd", "Ke", "Ks", "Ni", "Ns", "Tf")}
_LINE = re.compile(rb"[^\r\n]+")


@dataclass
class _Draft:
    """A material whose statements are being read."""

    name: str
    color: tuple[float, ...] = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    metallic: float = 0.0
    roughness: float = 1.0
    emissive: tuple[float, ...] = (0.0, 0.0, 0.0)
    textures: list[TextureUse] = field(default_factory=list)
    parameters: dict[str, str] = field(default_factory=dict)

    def finished(self) -> Material:
        red, green, blue = to_linear(np.array(self.color)).tolist()
        glow = to_linear(np.array(self.emissive)).tolist()
        see_through = self.alpha < 1 or any(use.slot == "alpha" for use in self.textures)
        return Material(
            name=self.name,
            base_color=(red, green, blue, self.alpha),
            metallic=self.metallic,
            roughness=self.roughness,
            emissive=(glow[0], glow[1], glow[2]),
            alpha_mode="BLEND" if see_through else "OPAQUE",
            double_sided=True,
            textures=tuple(self.textures),
            parameters=tuple(sorted(self.parameters.items())),
        )

    def say(self, statement: str, words: list[bytes]) -> None:
        """Keep a statement that nothing here is made of, to be compared with another file's."""
        if len(self.parameters) < _MOST_PARAMETERS:
            self.parameters[statement[:_LETTERS]] = _told(words)


class LibraryReader:
    """Reads material libraries and the images they name.

    Args:
        resources: files that were sent, by name.
        faults: where malformed statements are noted.

    Attributes:
        images: those that any material names.
    """

    def __init__(self, resources: Mapping[str, bytes], faults: Faults) -> None:
        self._resources = resources
        self._faults = faults
        self._numbers: dict[tuple[str, str], int] = {}
        self._folder = ""
        self.images: list[Image] = []

    def find(self, name: str) -> bytes | None:
        """A file that was sent, by the name or path that another file uses for it."""
        path = inside(name)
        for known in (path, name.replace("\\", "/").rpartition("/")[2]):
            sent = sent_as(known, self._resources) if known else None
            if sent is not None:
                return self._resources[sent]
        return None

    def read(self, library: str, data: bytes) -> Iterator[Material]:
        """The materials of one library.

        Args:
            library: its name, for messages.
            data: its bytes.
        """
        self._folder = library.replace("\\", "/").rpartition("/")[0]
        draft: _Draft | None = None
        for number, match in enumerate(_LINE.finditer(data.removeprefix(BYTE_ORDER_MARK)), 1):
            keyword, rest = (*match[0].split(None, 1), b"", b"")[:2]
            key = keyword.lower()
            if key == b"newmtl":
                if draft is not None:
                    yield draft.finished()
                draft = _Draft(rest.strip().decode("utf-8", "replace"))
            elif draft is not None:
                # Names keep their number signs, as those in the OBJ do.
                said = rest if key in _SLOTS else uncommented(rest)
                self._take(draft, key, said.split(), f"{library}, statement {number}")
        if draft is not None:
            yield draft.finished()

    def _take(self, draft: _Draft, key: bytes, words: list[bytes], place: str) -> None:
        if key in _SLOTS:
            draft.textures.append(self._texture(draft, _SLOTS[key], words))
        elif key in (b"kd", b"ke") and words[:1] not in ([b"spectral"], [b"xyz"]):
            color = self._numbers_of(words, place)
            if color and key == b"kd":
                draft.color = color if len(color) == 3 else (color[0],) * 3
            elif color:
                draft.emissive = color if len(color) == 3 else (color[0],) * 3
        elif key in (b"d", b"tr", b"pr", b"pm"):
            if b"-halo" in words:
                draft.say("d -halo", [b"on"])
            value = self._numbers_of([word for word in words if word != b"-halo"], place)
            if value:
                self._set(draft, key, value[0])
        elif not key.startswith(b"#"):
            draft.say(_SPELLED.get(key, key.decode("utf-8", "replace")), words)

    def _set(self, draft: _Draft, key: bytes, value: float) -> None:
        if key in (b"d", b"tr"):
            draft.alpha = value if key == b"d" else 1 - value
        elif key == b"pr":
            draft.roughness = value
        else:
            draft.metallic = value

    def _numbers_of(self, words: list[bytes], place: str) -> tuple[float, ...] | None:
        """One or three numbers."""
        values = [parse_number(word) for word in words[:3]]
        found = tuple(value for value in values if value is not None)
        if len(found) == len(values) and len(found) in (1, 3):
            return found
        self._faults.note(place, f"expected numbers, found '{shown(b' '.join(words))}'")
        return None

    def _texture(self, draft: _Draft, slot: str, words: list[bytes]) -> TextureUse:
        rest = list(words)
        vectors = {b"-o": [0.0, 0.0], b"-s": [1.0, 1.0]}
        wrap: Wrap = "repeat"
        while len(rest) > 1 and rest[0].lower() in (*_OPTIONS, *_VECTOR_OPTIONS):
            option = rest.pop(0).lower()
            taken = _OPTIONS.get(option) or _count_numbers(rest)
            values, rest = rest[:taken], rest[taken:]
            if option == b"-clamp":
                wrap = "clamp" if values == [b"on"] else "repeat"
            elif option not in vectors:
                draft.say(f"{slot} texture {option.decode()}", values)
            else:
                left_out = 1.0 if option == b"-s" else 0.0
                stated = [parse_number(word) or 0.0 for word in values]
                vectors[option] = [*stated, left_out, left_out][:2]
                if stated[2:] not in ([], [left_out]):
                    draft.say(f"{slot} texture {option.decode()} along w", values[2:])
        name = b" ".join(rest).decode("utf-8", "replace")
        return TextureUse(
            slot=slot,
            image=self._image(name),
            wrap=(wrap, wrap),
            offset=(vectors[b"-o"][0], vectors[b"-o"][1]),
            scale=(vectors[b"-s"][0], vectors[b"-s"][1]),
        )

    def _image(self, name: str) -> int:
        """The image of a name, which may be followed by a comment."""
        data = self._beside(name)
        bare = name.partition("#")[0].rstrip(" \t")
        if data is None and bare != name:
            data = self._beside(bare)
            name = bare if data is not None else name
        key = self._folder, name
        if key not in self._numbers:
            self._numbers[key] = len(self.images)
            self.images.append(Image(name, f"image '{name[:60]}'", data))
        return self._numbers[key]

    def _beside(self, name: str) -> bytes | None:
        """An image, which is looked for beside the library first."""
        data = self.find(f"{self._folder}/{name}") if self._folder else None
        return self.find(name) if data is None else data


def named_images(data: bytes) -> Iterator[str]:
    """The image files that a material library names.

    A name with a number sign comes once more without what follows: that may be a comment.
    """
    reader = LibraryReader({}, Faults())
    for _ in reader.read("", data):
        pass
    for image in reader.images:
        yield image.name
        if "#" in image.name:
            yield image.name.partition("#")[0].rstrip(" \t")


def _told(words: list[bytes]) -> str:
    """What a statement says, numbers as exporters agree on them."""
    numbers = map(parse_number, words)
    told = " ".join(
        word.decode("utf-8", "replace") if number is None else f"{round(number, _ROUNDING) + 0.0:g}"
        for word, number in zip(words, numbers, strict=True)
    )
    if len(told) <= _MOST_TOLD:
        return told
    return f"{told[:_MOST_TOLD]}… {hashlib.sha256(told.encode()).hexdigest()[:12]}"


def _count_numbers(words: list[bytes]) -> int:
    """How many numbers stand at the start: a file name follows them, which may be one too."""
    most = min(_MOST_NUMBERS, max(len(words) - 1, 1))
    count = 0
    while count < most and parse_number(words[count]) is not None:
        count += 1
    return count
