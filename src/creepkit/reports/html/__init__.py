"""A report as one HTML page, complete without scripts: findings, tests, ranking, data, methods, provenance."""

from creepkit.reports.html.page import report_html

__all__ = ["report_html"]
