"""A report as one HTML file, which a CI job stores and anyone opens, without a network."""

from service.html_report.document import ReportedAsset, html_report

__all__ = ["ReportedAsset", "html_report"]
