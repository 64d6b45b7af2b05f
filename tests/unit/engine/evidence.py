"""What a certificate is checked with, and ways to forge it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from meshcone.certificate.file import CertificateFile, read_certificate
from meshcone.files import MeshFile
from meshcone.options import Options, parse_options
from meshcone.report.report import Report
from meshcone.verbs.refine import refine
from meshcone.verbs.verify import verify


@dataclass(frozen=True)
class Evidence:
    """Everything `meshcone verify` takes."""

    report: Report
    certificate: CertificateFile
    source: MeshFile
    reference: MeshFile
    refined: MeshFile

    @staticmethod
    def of(source: MeshFile, reference: MeshFile, options: dict[str, Any]) -> Evidence:
        answer = refine(source, reference, parse_options(options))
        assert answer.certificate is not None
        return Evidence(
            Report.model_validate_json(answer.report.model_dump_json()),
            read_certificate(answer.certificate, "made"),
            source,
            reference,
            MeshFile(answer.name, answer.data),
        )

    def failed(self) -> set[str]:
        """Verify, and return the names of the checks that fail."""
        stored = MeshFile("certificate.npz", self.certificate.to_bytes())
        checks = verify(self.report, stored, self.source, self.reference, self.refined).checks
        return {check.name for check in checks if not check.ok}

    def with_forged_hashes(self) -> Evidence:
        """State the hashes and sizes of the files at hand."""
        source, reference, refined = (
            file.sha256 for file in (self.source, self.reference, self.refined)
        )
        inputs = self.report.inputs
        forged = {
            "inputs": inputs.model_copy(
                update={
                    "source": inputs.source.model_copy(
                        update={"sha256": source, "bytes": len(self.source.data)}
                    ),
                    "reference": inputs.reference.model_copy(
                        update={"sha256": reference, "bytes": len(self.reference.data)}
                    ),
                }
            ),
            "output": self.report.output.model_copy(
                update={"sha256": refined, "bytes": len(self.refined.data)}
            ),
        }
        return self.with_report(**forged).with_document(
            source_sha256=source, reference_sha256=reference, refined_sha256=refined
        )

    def with_document(self, **changes: object) -> Evidence:
        document = self.certificate.document.model_copy(update=changes)
        return self.with_certificate(document=document)

    def with_certificate(self, **changes: Any) -> Evidence:
        return replace(self, certificate=replace(self.certificate, **changes))

    def with_options(self, options: Options) -> Evidence:
        """State other options in the report and in the certificate."""
        return self.with_report(options=options).with_document(options=options)

    def with_report(self, **changes: object) -> Evidence:
        return replace(self, report=self.report.model_copy(update=changes))
