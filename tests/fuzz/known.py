"""Findings that are known and not mended yet, with the reason; `test_findings.py` holds their cases."""

KNOWN = {
    "RecursionError in wheelpend/model/toml_file.py:parse_model_file": "a model file that nests without end",
    "OverflowError in wheelpend/logs/faults.py:lying_samples": "times that are closer than a number can say",
    "ZeroDivisionError in wheelpend/logs/faults.py:lying_samples": "times of which one is beyond all others",
    "ValueError in wheelpend/logs/checks.py:moves": "times that are closer than any clock's",
    "LinAlgError in wheelpend/logs/white_noise.py:_prediction_errors": "a reading whose square is no number",
    "UnicodeEncodeError in wheelpend/files.py:write_text": "a file's name that is no UTF-8, in JSON written to a file",
    "UnicodeEncodeError in wheelpend/reports/console.py:emit_json": "the same on standard output",
}
