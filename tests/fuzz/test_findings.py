"""What the fuzzing found, each as small as it became."""

import pytest

from tests.fuzz.cases import Case
from tests.fuzz.invariants import check_case
from tests.fuzz.known import KNOWN

HEADER = b"t,v_in,theta_w,theta_p,dtheta_p\n"


def rows(line, count=40):
    """A log whose rows follow from their number."""
    return HEADER + b"".join(line(k).encode() + b"\n" for k in range(count))


FINDINGS = {
    "RecursionError in wheelpend/model/toml_file.py:parse_model_file": Case(
        "model damaged", (("generate", "--check"),), {"model.toml": b"a = " + b"[" * 3000 + b"]" * 3000}
    ),
    "OverflowError in wheelpend/logs/faults.py:lying_samples": Case(
        "csv",
        (("inspect", "hostile.csv"),),
        {"hostile.csv": rows(lambda k: f"{k}e-320,{k % 3},{k},0.{k % 7},0.{k % 5}")},
    ),
    "Error in wheelpend/logs/csv_text.py:split_cells": Case(
        "csv",
        (("inspect", "hostile.csv", "--json", "-"),),
        {"hostile.csv": rows(lambda k: f"{k},1,2,3,4").replace(b"\n", b"\r")},
    ),
    "a character that steers the terminal": Case(
        "model changed",
        (("generate", "--check"), ("effects",)),
        {"model.toml": b'"\\u0090\\u202e\\u001b[31m" = 1'},
    ),
}


def cases():
    for key, case in FINDINGS.items():
        marks = [pytest.mark.xfail(strict=True, reason=KNOWN[key])] if key in KNOWN else []
        yield pytest.param(case, id=key, marks=marks)


@pytest.mark.parametrize("case", list(cases()))
def test_what_was_found_is_not_found_again(case, tmp_path):
    check_case(case, tmp_path / "a" / "b" / "workspace")


def test_what_is_known_has_a_case():
    assert set(KNOWN) <= set(FINDINGS)
