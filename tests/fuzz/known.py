"""Findings that are known and not mended yet, with the reason; `test_findings.py` holds their cases."""

KNOWN = {
    "RecursionError in wheelpend/model/toml_file.py:parse_model_file": "a model file that nests without end",
    "OverflowError in wheelpend/logs/faults.py:lying_samples": "times that are closer than a number can say",
}
