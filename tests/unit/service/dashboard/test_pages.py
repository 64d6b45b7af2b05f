from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re

import pytest

from service.dashboard.libraries import swagger_file, three_js
from service.dashboard.pages import imported, module_urls, page
from service.dashboard.routes import static
from service.dashboard.static_files import own_names, required, static_file
from service.html_report import ReportedAsset, html_report
from service.problems import ProblemError

PAGES = ("jobs", "job", "compare", "docs")


def hashed(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def test_what_trimesh_carries_of_three_js_is_the_library_alone_of_revision_140() -> None:
    script = three_js().decode()

    assert script.startswith("/**\n * @license\n * Copyright 2010-2022 Three.js Authors\n")
    assert "SPDX-License-Identifier: MIT" in script
    assert script.count("\n") == 5  # a licence comment and one line
    assert 'const e="140"' in script
    assert "t.REVISION=e" in script
    # The template goes on with a loader and controls; the pages have their own.
    assert "GLTFLoader" not in script
    assert "TrackballControls" not in script
    assert "</script" not in script


def test_what_the_pages_use_of_three_js_is_in_it() -> None:
    script = three_js().decode()
    used: set[str] = set()
    for name in own_names():
        text = required(name).data.decode()
        used.update(re.findall(r"\bTHREE\.([A-Z]\w+)", text))
        for taken in re.findall(r"const \{ ([\w, ]+) \} = (?:this\.)?THREE;", text):
            used.update(taken.split(", "))
    exported = set(re.findall(r"\bt\.([A-Z]\w+)=", script))

    assert len(used) > 10
    assert used <= exported


@pytest.mark.parametrize("name", ["swagger-ui-bundle.js", "swagger-ui.css"])
def test_fastapi_swagger_still_carries_swagger_ui(name: str) -> None:
    assert len(swagger_file(name)) > 100_000


@pytest.mark.parametrize("kind", PAGES)
def test_a_page_names_its_files_by_their_content(kind: str) -> None:
    urls = re.findall(r'"(/static/([\w.-]+)\?v=(\w+))"', page(kind).html)

    assert urls
    for url, name, version in urls:
        assert required(name).url == url
        assert required(name).version == version


@pytest.mark.parametrize("kind", PAGES)
def test_the_policy_names_the_import_map_and_no_other_script_in_the_page(kind: str) -> None:
    made = page(kind)
    [imports] = re.findall(r'<script type="importmap">(.*?)</script>', made.html)
    inline = re.findall(r"<script(?: type=\"module\")?>", made.html)

    assert hashed(imports) in made.policy
    assert "unsafe" not in made.policy
    assert inline == []


@pytest.mark.parametrize("kind", PAGES)
def test_a_page_names_every_module_that_it_starts_with(kind: str) -> None:
    named = re.findall(r'<link rel="modulepreload" href="([^"]+)">', page(kind).html)

    module = f"meshcone/{kind}-page"
    started = [module, *imported(module)]
    texts = [required(f"{name.partition('/')[2]}.js").data.decode() for name in started]
    assert set(re.findall(r'\bfrom "(meshcone/[\w-]+)"', "".join(texts))) == set(started[1:])
    assert named == [module_urls()[name] for name in started[1:]]


def test_every_module_imports_what_there_is() -> None:
    known = {f"meshcone/{name.removesuffix('.js')}" for name in own_names()}
    for name in own_names():
        imported = re.findall(r'from "([^"]+)"', required(name).data.decode())
        assert set(imported) <= known, name


def test_no_file_of_ours_names_another_host() -> None:
    for name in own_names():
        text = required(name).data.decode()
        assert set(re.findall(r"https?://[\w.]+", text)) <= {"http://www.w3.org"}, name


def test_files_are_sent_compressed_and_kept_for_ever_under_their_version() -> None:
    file = required("three.js")
    answer = static("three.js", v=file.version, accept_encoding="gzip, br")

    assert gzip.decompress(bytes(answer.body)) == file.data
    assert "immutable" in answer.headers["cache-control"]
    assert len(answer.body) < 200_000


def test_a_file_without_its_version_is_asked_for_again() -> None:
    file = required("dashboard.css")
    answer = static("dashboard.css", v="of-yesterday")
    again = static("dashboard.css", if_none_match=answer.headers["etag"])

    assert answer.headers["cache-control"] == "no-cache"
    assert bytes(answer.body) == file.data
    assert again.status_code == 304


@pytest.mark.parametrize("name", ["../pages.py", "..%2fpages.py", "pages.py", "nothing.js"])
def test_nothing_else_is_sent(name: str) -> None:
    assert static_file(name) is None
    with pytest.raises(ProblemError):
        static(name)


def in_report(html: str, element: str) -> str:
    [text] = re.findall(rf'<script[^>]* id="{element}">(.*?)</script>', html, re.S)
    return text


def an_asset(name: str, ending: str = "fail", preview: bytes | None = b"glTF") -> ReportedAsset:
    return ReportedAsset(name=name, ending=ending, report="{}", preview=preview)


def test_a_report_holds_its_data_and_no_name_breaks_out() -> None:
    html = html_report("<title>", [an_asset("</script><script>alert(1)</script>")]).decode()

    [asset] = json.loads(in_report(html, "assets"))
    assert asset["name"] == "</script><script>alert(1)</script>"
    assert "<title>&lt;title&gt;</title>" in html
    assert gzip.decompress(base64.b64decode(in_report(html, "preview-0"))) == b"glTF"


def test_a_reports_policy_allows_its_own_scripts_alone() -> None:
    html = html_report("r", [an_asset("a")]).decode()
    [policy] = re.findall(r'Content-Security-Policy" content="(.*?)">', html)
    scripts = re.findall(r'<script(?: type="(?:module|importmap)")?>(.*?)</script>', html, re.S)

    assert len(scripts) == 4
    assert all(hashed(script) in policy for script in scripts)
    assert "unsafe" not in policy
    assert "http" not in policy


def test_of_many_meshes_those_that_did_not_pass_come_along() -> None:
    assets = [an_asset(str(number), "pass") for number in range(20)] + [an_asset("bad")]
    html = html_report("r", assets).decode()

    assert html.count('id="preview-') == 12
    assert 'id="preview-20"' in html


def test_meshes_are_said_to_be_left_out_where_there_were_any() -> None:
    audited = an_asset("audited", preview=None)
    assets = [audited, *(an_asset(str(number)) for number in range(13))]

    described = json.loads(in_report(html_report("r", assets).decode(), "assets"))

    assert [asset["name"] for asset in described if asset["leftOut"]] == ["12"]


def test_a_report_without_meshes_carries_no_library() -> None:
    with_one, without = (
        html_report("r", [an_asset("a", preview=preview)]) for preview in (b"glTF", None)
    )

    assert len(with_one) - len(without) > 500_000
