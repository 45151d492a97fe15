"""A report as one HTML page without scripts: findings first, then tests, ranking, data, methods and provenance."""

from creepkit.reports.html.page import report_html

__all__ = ["report_html"]
