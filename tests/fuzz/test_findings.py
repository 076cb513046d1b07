"""What the fuzzing found, each as small as it became."""

import random

import pytest

from tests.fuzz.cases import Case
from tests.fuzz.invariants import check_case, fresh_files
from tests.fuzz.known import KNOWN

HEADER = b"t,v_in,theta_w,theta_p,dtheta_p\n"


def sound_log(change):
    """The log of every workspace, its rows of cells changed in place."""
    table = [line.split(",") for line in fresh_files()["log.csv"].decode().splitlines()]
    change(table)
    return "\n".join(map(",".join, table)).encode()


def times_scaled(factor):
    def change(table):
        for k, row in enumerate(table[1:]):
            row[0] = repr(0.02 * k * factor)

    return sound_log(change)


def rows(line, count=40):
    """A log whose rows follow from their number."""
    return HEADER + b"".join(line(k).encode() + b"\n" for k in range(count))


def noise_on_wheel(table):
    """The wheel's angle lost in noise of 1 rad, from which the fitted machine falls."""
    for k, row in enumerate(table[1:]):
        row[2] = str(random.Random(7000 + k).gauss(0, 1))


def model_with_effect(name):
    return fresh_files()["model.toml"].replace(b"effects = []", f'effects = ["{name}"]'.encode())


OWN_LAW = """
[own_drag]
family = "drive"
sentence = "A drag of mine."
on = "drive"
law = "{law}"
dissipates = true

[own_drag.parameters.c]
unit = "V"
typical = 0.1
minimum = 0
maximum = 10
"""

FINDINGS = {
    "RecursionError in wheelpend/model/toml_file.py:parse_model_file": Case(
        "model damaged", (("generate", "--check"),), {"model.toml": b"a = " + b"[" * 3000 + b"]" * 3000}
    ),
    "OverflowError in wheelpend/logs/faults.py:lying_samples": Case(
        "csv times scaled", (("inspect", "hostile.csv"),), {"hostile.csv": times_scaled(1e-309)}
    ),
    "ZeroDivisionError in wheelpend/logs/faults.py:lying_samples": Case(
        "csv odd cell",
        (("inspect", "hostile.csv"),),
        {"hostile.csv": sound_log(lambda table: table[1].__setitem__(0, "-1e308"))},
    ),
    "ValueError in wheelpend/logs/checks.py:moves": Case(
        "csv times scaled", (("inspect", "hostile.csv"),), {"hostile.csv": times_scaled(1e-38)}
    ),
    "LinAlgError in wheelpend/logs/white_noise.py:_prediction_errors": Case(
        "csv odd cell",
        (("inspect", "hostile.csv"),),
        {"hostile.csv": sound_log(lambda table: [table[k].__setitem__(3, "1e308") for k in (1, 188)])},
    ),
    "UnicodeEncodeError in wheelpend/files.py:write_text": Case(
        "command history", (("history", "--model", "\udcff.csv", "--json", "slope"),)
    ),
    "UnicodeEncodeError in wheelpend/reports/console.py:emit_json": Case(
        "command history", (("history", "--model", "\udcff.csv", "--json", "-"),)
    ),
    "StopIteration in wheelpend/inspection/survey.py:survey_file": Case(
        "bytes", (("new", "started", "--from", "hostile.csv"),), {"hostile.csv": b"\xfe\xff"}
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
    "KeyError in derive/grammar.py:_float_value": Case(
        "effects law", (("add", "own_drag"),), {"effects.toml": OWN_LAW.format(law="log(c)").encode()}
    ),
    "KeyError(Abs) in derive/grammar.py:_float_value": Case(
        "effects law",
        (("effects", "own_drag"), ("add", "own_drag")),
        {"effects.toml": OWN_LAW.format(law="sqrt(c*c)*sign(speed)").encode()},
    ),
    "TypeError in wheelpend/logs/read.py:save_log": Case(
        "command simulate", (("simulate", "-o", "\udcff.csv", "--duration", "1"),)
    ),
    "ValueError in wheelpend/identification/energy.py:rates_by_spline": Case(
        "csv noise",
        (("identify", "hostile.csv", "--method", "energy", "--json", "-"),),
        {"hostile.csv": sound_log(noise_on_wheel)},
    ),
    "ValueError in wheelpend/model/equations.py:equation_sections": Case(
        "model effects", (("equations",),), {"model.toml": model_with_effect("backlash")}
    ),
    "the process ends with 1 at inspect": Case(
        "bytes", (("inspect", "hostile.csv", "--json", "-"),), {"hostile.csv": b'"><img src=x onerror=alert(1)>\n"'}
    ),
    "the generated code is stale afterwards": Case("command simulate", (("simulate", "-o", "model.toml"),)),
    "a failed command changed the workspace": Case(
        "command history", (("history", "--json", "model.toml", "--plant", "~"),)
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
