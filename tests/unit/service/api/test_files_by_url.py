"""Files named by URL: in a form or in a JSON document, checked before anything needs a broker."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pytest
from starlette.testclient import TestClient

from meshcone.errors import InputError, LimitError, MeshConeError
from service.api.request_schemas import LinkedFile
from service.api.submission.document import DOCUMENT_BYTES, submission_in
from service.api.submission.parts import named_file
from service.settings import ServiceSettings
from worker.jobs.records import RemoteFile
from worker.transfers.settings import Authorization

SETTINGS = ServiceSettings(
    fetch_buckets=("s3://incoming", "s3://shared/meshes"),
    output_buckets=("s3://results",),
    transfer_authorizations={"cdn": Authorization(host="assets.example.org", value="Bearer 3f9a")},
)
MUG = {"url": "https://assets.example.org/mug.glb"}
SHA256 = "0" * 64


def named(file: Mapping[str, Any], field: str = "source") -> Any:
    return named_file(field, LinkedFile(**file), SETTINGS)


def refused(document: Any) -> MeshConeError:
    with pytest.raises(MeshConeError) as caught:
        submission_in(document, SETTINGS)
    return caught.value


def test_the_name_is_the_last_part_of_the_path() -> None:
    file = named({"url": "https://assets.example.org/a/red%20mug.glb?token=x", "sha256": SHA256})

    assert file == RemoteFile(
        name="red mug.glb",
        url="https://assets.example.org/a/red%20mug.glb?token=x",
        sha256=SHA256,
    )
    assert file.origin == "https://assets.example.org/a/red%20mug.glb"


@pytest.mark.parametrize("tricky", ["..%2F..%2Fmug.glb", "..%5C..%5Cmug.glb", "%00mug.glb"])
def test_a_name_leads_nowhere(tricky: str) -> None:
    assert named({"url": f"https://assets.example.org/{tricky}"}).name == "mug.glb"


@pytest.mark.parametrize("end", ["", ".", "%2e%2e"])
def test_a_url_without_a_name_needs_one(end: str) -> None:
    with pytest.raises(InputError, match="give one as 'name'"):
        named({"url": f"https://assets.example.org/{end}"})

    assert named({"url": "https://assets.example.org/", "name": "mug.glb"}).name == "mug.glb"


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("http://assets.example.org/mug.glb", "begins with https://"),
        ("https://10.0.0.1/mug.glb", "not a public one"),
        ("https://user:word@assets.example.org/mug.glb", "user or a password"),
        ("s3://other/mug.glb", "MESHCONE_FETCH_BUCKETS"),
        ("s3://shared/mug.glb", "MESHCONE_FETCH_BUCKETS"),
        ("s3://shared/meshes-of-others/mug.glb", "MESHCONE_FETCH_BUCKETS"),
        ("s3://shared/meshes/../mug.glb", "without '..'"),
        ("s3://shared/meshes//mug.glb", "without '..'"),
        ("s3://incoming/", "without '..'"),
        ("s3://incoming", "MESHCONE_FETCH_BUCKETS"),
    ],
)
def test_what_this_installation_would_not_fetch_is_refused_at_once(url: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        named({"url": url, "name": "mug.glb"})


@pytest.mark.parametrize("url", ["s3://incoming/a/mug.glb", "s3://shared/meshes/mug.glb"])
def test_an_object_of_an_allowed_bucket_is_accepted(url: str) -> None:
    assert named({"url": url}).name == "mug.glb"


def test_a_secret_is_named_and_belongs_to_its_host() -> None:
    assert named({**MUG, "authorization": "cdn"}).authorization == "cdn"
    with pytest.raises(InputError, match="no authorization 'cnd'"):
        named({**MUG, "authorization": "cnd"})
    for other in ("https://other.example.org/m.glb", "https://assets.example.org:8443/m.glb"):
        with pytest.raises(InputError, match="is not for https://"):
            named({"url": other, "authorization": "cdn"})
    with pytest.raises(InputError, match="takes no 'authorization'"):
        named({"url": "s3://incoming/mug.glb", "authorization": "cdn"})


def test_only_a_mesh_that_is_a_gltf_has_its_own_resources_fetched() -> None:
    assert named({**MUG, "resources": "relative"}).resources == "relative"
    with pytest.raises(InputError, match=r"only a \.gltf or \.glb"):
        named({"url": "https://assets.example.org/mug.obj", "resources": "relative"})
    with pytest.raises(InputError, match="what a mesh names"):
        named({**MUG, "resources": "relative"}, "source_resources")


def test_a_document_says_what_a_form_says() -> None:
    form = submission_in(
        {
            "source": MUG,
            "reference": {"name": "scan.glb", "sha256": SHA256},
            "source_resources": [{"url": "https://assets.example.org/a.bin", "name": "data/a.bin"}],
            "options": {"mode": "measure"},
            "labels": ["nightly", "nightly"],
            "webhook": "https://example.org/hook",
        },
        SETTINGS,
    )

    assert form.source.name == "mug.glb"
    assert form.reference is not None
    assert form.reference.name == "scan.glb"
    assert [file.name for file in form.source_resources] == ["data/a.bin"]
    assert (form.options.mode, form.options_as_sent) == ("measure", {"mode": "measure"})
    assert (form.labels, form.webhook) == (("nightly",), "https://example.org/hook")


def test_an_audit_needs_no_more_than_a_source() -> None:
    assert submission_in({"source": MUG, "options": {"mode": "audit"}}, SETTINGS).reference is None


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ([], "expected an object with names and values, found a list"),
        ({}, "field 'source': field required"),
        ({"source": MUG, "label": "a"}, "unknown field 'label'; the fields are source, reference"),
        ({"source": {**MUG, "uri": "x"}}, "unknown field 'source.uri'"),
        ({"source": MUG}, "'reference' is missing"),
        ({"source": MUG, "reference": MUG, "options": {"sed": 1}}, "did you mean 'seed'?"),
        ({"source": MUG, "reference": MUG, "options": []}, "field 'options': "),
        ({"source": MUG, "reference": MUG, "labels": "a"}, "field 'labels': expected a list"),
        ({"source": MUG, "reference": MUG, "labels": ["a\nb"]}, "one line"),
        ({"source": MUG, "reference": MUG, "webhook": "http://a.org"}, "https://"),
    ],
)
def test_a_document_that_cannot_be_used_is_explained(document: Any, said: str) -> None:
    error = refused(document)

    assert isinstance(error, InputError)
    assert said in error.message


def test_outputs_are_named_like_what_a_job_makes() -> None:
    places = {"mesh": MUG, "report": {"url": "s3://results/mug.json"}}

    form = submission_in({"source": MUG, "reference": MUG, "outputs": places}, SETTINGS)

    assert {name: output.url for name, output in form.outputs.items()} == {
        "mesh": MUG["url"],
        "report": "s3://results/mug.json",
    }


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        ({"mash": MUG}, "field 'outputs.mash': input should be 'mesh'"),
        ({"mesh": {"uri": "x"}}, "unknown field 'outputs.mesh.uri'"),
        ({"mesh": {"url": "s3://incoming/mug.glb"}}, "MESHCONE_OUTPUT_BUCKETS"),
        ({"mesh": {"url": "http://example.org/mug.glb"}}, "the URL of output 'mesh' must be"),
        ({"mesh": {"url": "https://127.0.0.1/mug.glb"}}, "not a public one"),
        ({"mesh": {**MUG, "authorization": "cnd"}}, "no authorization 'cnd'"),
    ],
)
def test_a_place_for_a_result_that_cannot_be_used_is_refused_at_once(
    outputs: Any, said: str
) -> None:
    assert said in refused({"source": MUG, "reference": MUG, "outputs": outputs}).message


def test_options_in_a_document_have_the_bound_of_those_in_a_form() -> None:
    options = {"gates": {"x" * 70_000: {"max": 1}}}

    assert isinstance(refused({"source": MUG, "reference": MUG, "options": options}), LimitError)


def posted(http: TestClient, text: bytes) -> tuple[int, str]:
    answer = http.post("/v1/jobs", content=text, headers={"Content-Type": "application/json"})
    return answer.status_code, answer.json()["detail"]


def test_a_sound_document_gets_as_far_as_the_broker(http: TestClient) -> None:
    document = {"source": MUG, "options": {"mode": "audit"}}

    assert posted(http, json.dumps(document).encode())[0] == 503  # there is none


@pytest.mark.parametrize("text", [b"", b"nope", b"\xff", b"[" * 100_000])
def test_what_is_no_json_is_said(http: TestClient, text: bytes) -> None:
    assert posted(http, text) == (422, "the request is not valid JSON")


def test_a_document_too_long_to_hold_is_refused() -> None:
    assert SETTINGS.max_upload_bytes > DOCUMENT_BYTES


def test_a_form_takes_a_url_in_place_of_a_file(http: TestClient) -> None:
    data = {"options": "{}", "source": json.dumps(MUG), "reference": json.dumps(MUG)}

    answer = http.post("/v1/jobs", data=data, files=[("resources", ("a.bin", b"1"))])

    assert answer.status_code == 503, answer.text  # a sound form, and no broker to take it to


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        ("nope", "form field 'outputs' is not valid JSON"),
        ("[" * 20_000, "form field 'outputs' is not valid JSON"),
        (r'{"mesh": {"url": "https://a.org/\ud800"}}', "form field 'outputs': invalid json"),
        (
            '{"mesh": {"url": "https://a.org/b"}, "mesh": {"url": "https://a.org/c"}}',
            "form field 'outputs': 'mesh' is there twice in one object",
        ),
        ('{"mash": {"url": "https://a.org/b"}}', "form field 'outputs.mash'"),
        ('{"mesh": {}}', "form field 'outputs.mesh.url': field required"),
    ],
)
def test_outputs_of_a_form_that_cannot_be_used_are_explained(
    http: TestClient, outputs: str, said: str
) -> None:
    data = {"source": json.dumps(MUG), "reference": json.dumps(MUG), "outputs": outputs}

    answer = http.post("/v1/jobs", data=data, files=[("resources", ("a.bin", b"1"))])

    assert answer.status_code == 422
    assert said in answer.json()["detail"]


def test_a_file_of_a_form_that_is_named_twice_is_refused(http: TestClient) -> None:
    source = '{"url": "https://a.org/a.glb", "url": "https://a.org/b.glb"}'
    data = {"source": source, "reference": json.dumps(MUG)}

    answer = http.post("/v1/jobs", data=data, files=[("resources", ("a.bin", b"1"))])

    assert answer.json()["detail"] == (
        "form field 'source': 'url' is there twice in one object; keep one of the two"
    )
