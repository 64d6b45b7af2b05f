"""Whether the files at hand are those that report and certificate name."""

from __future__ import annotations

from collections.abc import Iterator

from meshcone.certificate.checks import Check
from meshcone.certificate.file import CertificateDocument
from meshcone.files import MeshFile
from meshcone.report.report import Report


def identity_checks(
    report: Report,
    document: CertificateDocument,
    source: MeshFile,
    reference: MeshFile,
    refined: MeshFile,
) -> Iterator[Check]:
    """Compare hashes, and what report and certificate both state."""
    sent = report.inputs
    source_there, reference_there = document.source_sha256, document.reference_sha256
    yield _file("source file", source, sent.source.sha256, source_there)
    yield _file("reference file", reference, sent.reference.sha256, reference_there)
    yield _file("refined file", refined, report.output.sha256, document.refined_sha256)
    yield from _resources(source, sent.source.resources, document.source_resources)
    yield from _resources(reference, sent.reference.resources, document.reference_resources)
    alignment = None if report.alignment is None else report.alignment.matrix
    yield _same("version", report.version == document.version)
    yield _same("options", report.options == document.options)
    yield _same("candidate", report.solver.candidate == document.candidate)
    yield _same("alignment", alignment == document.alignment)


def _file(name: str, file: MeshFile, in_report: str, in_certificate: str) -> Check:
    return _hashed(name, file.name, file.sha256, in_report, in_certificate)


def _resources(
    file: MeshFile, in_report: dict[str, str], in_certificate: dict[str, str]
) -> Iterator[Check]:
    """Compare the files that came with a mesh, as far as they are here.

    One that is needed and missing is noticed in reading; a texture nobody kept is no fault.
    """
    found = file.resource_hashes
    for name in sorted({*in_report, *in_certificate} & found.keys()):
        yield _hashed("resource", name, found[name], in_report.get(name), in_certificate.get(name))


def _hashed(
    name: str, file: str, found: str, in_report: str | None, in_certificate: str | None
) -> Check:
    ok = found == in_report == in_certificate
    hash_of = "the hash" if ok else "another hash than"
    return Check(name, ok, f"{file} has {hash_of} report and certificate state")


def _same(name: str, ok: bool) -> Check:
    words = f"report and certificate state the same {name}"
    return Check(name, ok, words if ok else words.replace("the same", "another"))
