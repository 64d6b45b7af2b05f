"""What is wrong with a form is said before anything needs a broker."""

from __future__ import annotations

import json
from typing import Any

import pytest
from starlette.testclient import TestClient

from meshcone.errors import InputError
from meshcone.relative_names import NAME_LENGTH
from service.api.submission.parts import file_name

TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
MESH = ("mug.obj", TRIANGLE)
DEFAULTS = {"options": "{}"}


def detail(http: TestClient, files: Any, data: dict[str, Any], status: int = 422) -> str:
    answer = http.post("/v1/jobs", files=files, data=data)
    assert answer.status_code == status, answer.text
    found: str = answer.json()["detail"]
    return found


def both(source: Any = MESH, reference: Any = MESH) -> list[tuple[str, Any]]:
    return [("source", source), ("reference", reference)]


@pytest.mark.parametrize("missing", ["source", "reference"])
def test_a_missing_mesh_is_named(http: TestClient, missing: str) -> None:
    files = [(field, mesh) for field, mesh in both() if field != missing]

    assert f"form field '{missing}' is missing" in detail(http, files, DEFAULTS)


def test_a_form_without_options_is_a_sound_one(http: TestClient) -> None:
    assert "broker cannot be reached" in detail(http, both(), {}, status=503)


def test_options_may_come_as_a_file(http: TestClient) -> None:
    files = [*both(), ("options", ("options.json", b'{"sed": 1}'))]

    assert detail(http, files, {}) == "unknown option 'sed'; did you mean 'seed'?"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("nope", "options are not valid JSON"),
        ("[]", "options must be a JSON object, found an array"),
        ('{"sed": 1}', "unknown option 'sed'; did you mean 'seed'?"),
        ('{"seed": -1}', "option 'seed': input should be greater than or equal to 0"),
    ],
)
def test_options_that_cannot_be_used_are_explained(
    http: TestClient, options: str, said: str
) -> None:
    assert detail(http, both(), {"options": options}) == said


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"within": "5 parsecs?"}, "option 'within': '5 parsecs?' is not a tolerance"),
        ({"within": "5mm", "mode": "measure"}, "option 'within': it is for refinements"),
        ({"within": "5mm", "deviation": {"prove": False}}, "a tolerance needs the proof"),
        ({"within": "1", "gates": {"deviation.max": {"max": 1}}}, "there is one already"),
        ({"within": "5mi"}, "a gltf is in metres, and 'mi' is not a known unit"),
    ],
)
def test_a_tolerance_that_cannot_be_used_is_refused_at_the_door(
    http: TestClient, options: dict[str, Any], said: str
) -> None:
    files = both(reference=("mug.glb", b""))

    assert said in detail(http, files, {"options": json.dumps(options)}).replace("glTF", "gltf")


def test_a_misspelt_field_is_named_with_those_there_are(http: TestClient) -> None:
    said = detail(http, [("source", MESH), ("refrence", MESH)], DEFAULTS)

    assert said.startswith("unknown form field 'refrence'; the fields are source, reference")


def test_a_mesh_sent_as_text_is_told_how_to_send_a_file(http: TestClient) -> None:
    said = detail(http, [("reference", MESH)], {**DEFAULTS, "source": "mug.obj"})

    assert "must be a file with a file name" in said


def test_a_mesh_sent_twice_is_refused(http: TestClient) -> None:
    assert "is sent 2 times" in detail(http, [*both(), ("source", MESH)], DEFAULTS)


def test_two_resources_of_one_name_are_refused(http: TestClient) -> None:
    files = [*both(), ("resources", ("a.bin", b"1")), ("resources", ("a.bin", b"2"))]

    assert detail(http, files, DEFAULTS) == "form field 'resources' has two files of this name"


def test_each_side_may_have_a_resource_of_the_same_name(http: TestClient) -> None:
    files = [
        *both(),
        ("source_resources", ("a.bin", b"1")),
        ("reference_resources", ("a.bin", b"2")),
    ]

    answer = http.post("/v1/jobs", files=files, data=DEFAULTS)

    assert answer.status_code == 503, answer.text  # a sound form, and no broker to take it to


@pytest.mark.parametrize("side", ["source", "reference"])
def test_a_resource_for_both_sides_and_for_one_is_refused(http: TestClient, side: str) -> None:
    files = [*both(), ("resources", ("a.bin", b"1")), (f"{side}_resources", ("a.bin", b"1"))]

    assert detail(http, files, DEFAULTS) == (
        f"form field '{side}_resources' has a file of this name and so has 'resources', "
        "which is for both meshes: send it in one of them"
    )


def test_the_resources_of_both_sides_count_together(http: TestClient) -> None:
    fields = ("source_resources", "reference_resources", "resources")
    files = both() + [(field, (f"{field}.bin", b"")) for field in fields]

    assert "3 resources are more than the 2 accepted" in detail(http, files, DEFAULTS, 413)


def test_more_resources_than_accepted_are_refused(http: TestClient) -> None:
    files = both() + [("resources", (f"{number}.bin", b"")) for number in range(3)]

    assert "3 resources are more than the 2 accepted" in detail(http, files, DEFAULTS, 413)


def test_more_parts_than_accepted_are_refused_before_they_are_all_read(http: TestClient) -> None:
    files = both() + [("resources", (f"{number}.bin", b"")) for number in range(100)]
    labels = {**DEFAULTS, "label": ["again"] * 100}

    assert "Too many files" in detail(http, files, DEFAULTS, 413)
    assert "Too many fields" in detail(http, both(), labels, 413)


def test_a_label_is_one_short_line(http: TestClient) -> None:
    assert "'label' must be one line" in detail(http, both(), {**DEFAULTS, "label": "x" * 201})
    assert "'label' must be one line" in detail(http, both(), {**DEFAULTS, "label": "a\nb"})


def test_a_label_may_be_an_emoji_of_several_characters(http: TestClient) -> None:
    assert "broker" in detail(http, both(), {**DEFAULTS, "label": "👩\u200d🚀"}, 503)


@pytest.mark.parametrize("blank", ["\u00a0", "\u202f", "\u3000", "\u200c", "\u200d", "\u00ad"])
def test_a_resource_is_found_by_a_name_that_has_more_than_letters(blank: str) -> None:
    assert file_name("resources", f"data/a{blank}b.bin") == f"data/a{blank}b.bin"


def test_a_path_that_is_too_long_is_refused_and_not_cut_to_that_of_another_file() -> None:
    longest = f"a/{'b' * (NAME_LENGTH - 2)}"
    assert file_name("resources", longest) == longest

    for path in (f"{longest}b", f"aa../{'c' * (NAME_LENGTH - 3)}"):
        with pytest.raises(InputError, match="up to 255 can be used") as caught:
            file_name("resources", path)
        assert caught.value.file == path.rpartition("/")[2]


def test_a_mesh_with_a_long_name_keeps_the_end_of_it() -> None:
    assert file_name("source", f"{'m' * 300}.obj") == f"{'m' * (NAME_LENGTH - 4)}.obj"


@pytest.mark.parametrize("folder", [".", "..", "a/..", "C:\\work\\."])
@pytest.mark.parametrize("field", ["source", "resources"])
def test_a_folder_is_no_name(field: str, folder: str) -> None:
    with pytest.raises(InputError, match="has no name"):
        file_name(field, folder)


def test_a_path_in_a_file_name_is_not_repeated(http: TestClient) -> None:
    answer = http.post(
        "/v1/jobs", files=both(source=("C:\\work\\/home/me/mug.obj", b"")), data=DEFAULTS
    )

    assert answer.json()["file"] == "mug.obj"


def test_a_resource_may_have_a_path_as_the_mesh_names_it(http: TestClient) -> None:
    buffer = {"uri": "data/part%201.bin", "byteLength": 36}
    document = {"asset": {"version": "2.0"}, "buffers": [buffer]}
    document |= {
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
    }
    source = ("mug.gltf", json.dumps(document).encode())
    sent = ("source_resources", (".\\data\\part 1.bin", bytes(35)))

    said = detail(http, [*both(source=source), sent], DEFAULTS)

    assert said == "declares 36 bytes, the buffer has 35"


def test_a_mesh_that_cannot_be_written_is_refused_as_source(http: TestClient) -> None:
    ply = (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        b"property float z\nproperty list uchar int of\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n"
        b"0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n"
    )

    answer = http.post("/v1/jobs", files=both(source=("mug.ply", ply)), data=DEFAULTS)

    assert answer.status_code == 422
    assert answer.json()["file"] == "mug.ply"


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("http://example.org/", "the webhook must be a URL that begins with https://"),
        ("https://10.0.0.1/", "the webhook leads to an address that is not a public one"),
        ("https://example.org/", "there is nothing to sign the webhook with"),
    ],
)
def test_a_webhook_that_cannot_be_sent_is_refused(http: TestClient, url: str, said: str) -> None:
    assert said in detail(http, both(), {**DEFAULTS, "webhook": url})


@pytest.mark.parametrize(
    "options",
    [
        r'{"gates": {"\ud800": {"max": 1}}}',
        r'{"select": {"nodes": ["a\udfff"]}}',
        r'{"\udc00": 1}',
        r'{"align": "\ud800"}',
    ],
    ids=["a gate's name", "a name in a list", "an option's name", "a value"],
)
def test_half_a_surrogate_pair_in_options_is_refused_in_words(
    http: TestClient, options: str
) -> None:
    assert "half of a surrogate pair" in detail(http, both(), {"options": options})


def test_deeply_nested_options_are_refused_in_words(http: TestClient) -> None:
    options = '{"seed": ' + "[" * 900 + "]" * 900 + "}"

    assert "option 'seed'" in detail(http, both(), {"options": options})


@pytest.mark.parametrize("charset", ["utf-7", "idna", "undefined", "unicode_escape"])
def test_a_form_in_another_charset_is_refused_in_words(http: TestClient, charset: str) -> None:
    body = b'--x\r\nContent-Disposition: form-data; name="label"\r\n\r\n+2AA-\r\n--x--\r\n'
    kind = f"multipart/form-data; boundary=x; charset={charset}"

    answer = http.post("/v1/jobs", content=body, headers={"Content-Type": kind})

    assert (answer.status_code, answer.json()["detail"]) == (
        415,
        "send the form as UTF-8, without another charset",
    )


def test_a_named_file_with_half_a_surrogate_pair_is_refused_in_words(http: TestClient) -> None:
    blob = r'{"name": "\ud800.obj", "sha256": "' + "0" * 64 + '"}'
    data = {**DEFAULTS, "source": blob}

    assert "form field 'source' must be" in detail(http, [("reference", MESH)], data)


@pytest.mark.parametrize("as_file", [False, True], ids=["as a field", "as a file"])
def test_options_longer_than_the_cap_are_told_what_to_do(http: TestClient, as_file: bool) -> None:
    options = '{"cones": {"pin": {"vertices": [' + "0," * 40_000 + "0]}}}"
    files = [*both(), ("options", ("o.json", options.encode()))] if as_file else both()

    said = detail(http, files, {} if as_file else {"options": options}, 413)

    assert "than the 65536 bytes accepted here" in said
    assert "cones.pin.vertices_file" in said


def test_a_list_that_the_options_name_has_to_be_sent(http: TestClient) -> None:
    options = '{"cones": {"pin": {"vertices_file": "pins.json"}}}'

    assert "names 'pins.json', which was not sent" in detail(http, both(), {"options": options})


def test_resources_of_a_reference_that_was_not_sent_are_refused(http: TestClient) -> None:
    files = [("source", MESH), ("reference_resources", ("a.bin", b"1"))]

    said = detail(http, files, {"options": '{"mode": "audit"}'})

    assert said == "form field 'reference_resources' is sent without a 'reference'"
