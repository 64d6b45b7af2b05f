"""OBJ files with everything the format knows, in any order and any hand."""

from __future__ import annotations

from hypothesis import strategies as st

_FORMATS = ["%g", "%.6f", "%.3f", "%e", "%+.2f", "%.9g", "%d"]
_GAPS = [b" ", b"  ", b"\t", b" \\\n ", b"\\\r\n", b" \v"]
_COMMENTS = [b"", b"", b" # v 9 9 9", b"# \xff\xfe", b" #\\"]
_OTHERS = [
    b"",
    b"# f 1 2 3",
    b"#\\",
    b"o a  b",
    b"o \xc3\xa4",
    b"g",
    b"g one two \xff",
    b"usemtl steel",
    b"usemtl a # b",
    b"mtllib a.mtl \\\n b.mtl",
    b"s off",
    b"vt 0 0.50",
    b"vt 1",
    b"vp 1 2 3",
    b"vx 1 2 3",
    b"l -1 1",
    b"p 1",
    b"call evil.obj",
    b"\t",
    b"    ",
]


@st.composite
def obj_files(draw: st.DrawFn) -> bytes:
    """An OBJ file of at least one face with an area."""
    style = draw(st.sampled_from(_FORMATS))
    gap = draw(st.sampled_from([*_GAPS, None]))
    line_end = draw(st.sampled_from([b"\n", b"\r\n", b"\r", None]))

    def spaced(words: list[bytes]) -> bytes:
        joined = words[0]
        for word in words[1:]:
            joined += (draw(st.sampled_from(_GAPS)) if gap is None else gap) + word
        return draw(st.sampled_from([b"", b"", b" ", b"\t"])) + joined

    def vector(keyword: bytes, numbers: list[float]) -> bytes:
        extras = draw(st.sampled_from([[], [], [b"1"], [b".5", b"0", b"1.000"]]))
        return spaced([keyword, *(_number(draw, style, value) for value in numbers), *extras])

    statements = [vector(b"v", point) for point in ([0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 1])]
    statements += [b"vn 0 0 1", vector(b"vn", [1, 0, 0]), b"vt 0 0"]
    vertices, normals = 4, 2
    coordinate = st.integers(-3, 3) | st.floats(-5, 5, width=32)
    for _ in range(draw(st.integers(1, 12))):
        action = draw(st.integers(0, 5))
        if action == 0:
            statements.append(vector(b"v", [draw(coordinate) for _ in range(3)]))
            vertices += 1
        elif action == 1:
            statements.append(vector(b"vn", [draw(coordinate) for _ in range(3)]))
            normals += 1
        elif action in (2, 3):
            statements.append(spaced([b"f", *_corners(draw, vertices, normals)]))
        else:
            statements.append(draw(st.sampled_from(_OTHERS)))
    statements.append(b"f 1 2 3")
    data = draw(st.sampled_from([b"", b"\xef\xbb\xbf"]))
    for statement in statements:
        comment = draw(st.sampled_from(_COMMENTS)) if b"#" not in statement else b""
        end = line_end or draw(st.sampled_from([b"\n", b"\r\n"]))
        data += statement + comment + end
    return data[: -len(end)] if draw(st.booleans()) else data


def _number(draw: st.DrawFn, style: str, value: float) -> bytes:
    text = style % value
    if draw(st.integers(0, 9)) == 0:
        text = repr(float(value)).removeprefix("0") or "0"
    return text.encode()


def _corners(draw: st.DrawFn, vertices: int, normals: int) -> list[bytes]:
    form = draw(st.sampled_from(["{v}", "{v}/1", "{v}//{n}", "{v}/1/{n}", "{rv}/-1/{rn}", "{rv}"]))
    size = draw(st.sampled_from([1, 2, 3, 3, 4, 5]))
    corners = []
    for _ in range(size):
        v, n = draw(st.integers(1, vertices)), draw(st.integers(1, normals))
        corners.append(form.format(v=v, n=n, rv=v - vertices - 1, rn=n - normals - 1).encode())
    return corners
