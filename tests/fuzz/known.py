"""Findings that are known and not mended yet, with the reason; `test_findings.py` holds their cases."""

KNOWN: dict[str, str] = {}
