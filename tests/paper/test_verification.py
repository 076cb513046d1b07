"""The printed equations of the paper against the derivation: what is found, and that it is found."""

import re

import pytest
import sympy as sp

from tests.support import ROOT
from wheelpend.paper.differences import is_zero
from wheelpend.paper.equations import PRINTED_EQUATIONS
from wheelpend.paper.findings import FINDING_STATUSES
from wheelpend.paper.letters import (  # fmt: skip
    J_b,
    J_m,
    M,
    R,
    V,
    alpha,
    beta,
    dp,
    dphi2_0,
    dw,
    epsilon,
    f_m,
    f_w,
    m,
    nfc,
    nu2,
    p,
    phi1_0,
    phi2_0,
    phi2_s,
    phi2_t,
    s,
    tau1,
    tau2,
    w,
)
from wheelpend.paper.page import page_text
from wheelpend.paper.relations import EQUATION_RELATIONS
from wheelpend.paper.verification import verify
from wheelpend.paper.verification_text import print_verification
from wheelpend.serialise import dumps, to_json

X2, X5, X7 = (sp.Symbol(f"X{k}", real=True) for k in (2, 5, 7))
MISPRINTS = {"9": "sign", "13": "dot", "18": "factor ε", "20": "sin(θp)", "34": "s + 1/τ1", "41": "1/τ1"}
SECOND_TERM = "φ2,2f(s), second line, second term"
CORRECT = {
    ("9", "T_L"): f_m * (dw - dp),
    ("13", "F_θp"): -alpha * V + 2 * (beta + f_w) * dw - 2 * beta * dp,
    ("18", "X2"): 2 * epsilon**2 * J_m / alpha,
    ("20", "V_in"): PRINTED_EQUATIONS["20"]["V_in"] + 2 * X5 * sp.sin(p),
    ("34", SECOND_TERM): (s + 1 / tau1) * (-nu2 * phi2_s - phi2_0) / (tau1 * tau2 * (s + 1 / tau1) * (s + 1 / tau2)),
    ("41", nfc("Ÿ1,2(t)")): PRINTED_EQUATIONS["41"][nfc("Ÿ1,2(t)")].subs(sp.Symbol("φ1(t)", real=True),
                                                                   sp.Symbol("φ1(t)", real=True) / tau1),
}  # fmt: skip
DAMAGE = [  # equation, component, what is put in place of what
    ("1", "L", J_b, -J_b),
    ("1", "L", J_m, epsilon * J_m),
    ("2", "F_q", sp.Symbol("∂L/∂θ_q", real=True), -sp.Symbol("∂L/∂θ_q", real=True)),
    ("3", "F_θw", m, m / 2),
    ("3", "F_θw", sp.sin(p), -sp.sin(p)),
    ("4", "F_θp", J_b, 0),
    ("5", "V_in", sp.Symbol("w", real=True), -sp.Symbol("w", real=True)),
    ("6", "J_m dw/dt", sp.Symbol("T_L", real=True), -sp.Symbol("T_L", real=True)),
    ("7", "V_in", sp.Symbol("i", real=True), -sp.Symbol("i", real=True)),
    ("8", "J_m dw/dt", V, 2 * V),
    ("11", "F_θw", f_w, -f_w),
    ("11", "F_θw", dp, p),
    ("12", "α", epsilon, 1),
    ("12", "β", f_m, -f_m),
    ("14", "α V_in", beta, beta / 2),
    ("15", "α V_in", f_w, 0),
    ("15", "α V_in", J_m, 0),
    ("17", "X", sp.MatrixSymbol("Y", 3, 1), -sp.MatrixSymbol("Y", 3, 1)),
    ("18", "X1", R, 1),
    ("18", "X3", M, M / 2),
    ("18", "X6", f_w, -f_w),
    ("19", "V_in", X7, -X7),
    ("19", "V_in", dp, p),
    ("21", "τ(t)", V, -V),
    ("22", "φ(t)", dw, -dw),
    ("23", "φ13", dp, 2 * dp),
    ("23", "φ25", sp.sin(p), sp.cos(p)),
    ("25", "φ(t)", sp.Symbol("φ0(t)", real=True), 0),
    ("26", "φ2(t)", w, -w),
    ("26", "φ1(t)", sp.cos(p), 1),
    ("26", "φ0(t)", dw, dp),
    ("28", "φ(s)", sp.Symbol("φc(s)", real=True), 0),
    ("29", "φa(s)", dphi2_0, -dphi2_0),
    ("34", "φ2,2f(s), third line", phi2_0, -phi2_0),
    ("35", "Y2,2(s)", phi2_0, tau1 * phi2_0),
    ("36", "ν2", tau2, -tau2),
    ("37", "φ1,2f(s), first line", phi1_0, -phi1_0),
    ("38", "Y1,1(s)", tau2, tau1),
    ("40", "φ2′(t)", phi2_t, -phi2_t),
    ("41", nfc("Ẏ2,1(t)"), nu2, 1),
    ("42", nfc("Ẏ2,2(0)"), dphi2_0, -dphi2_0),
    ("42", "Y2,1(0)", phi2_0, -phi2_0),
]  # fmt: skip


@pytest.fixture(scope="module")
def paper():
    return verify()


def printed_with(number, name, expression):
    return {**PRINTED_EQUATIONS, number: {**PRINTED_EQUATIONS[number], name: expression}}


def misprints(verification):
    return {(c.number, c.name) for c in verification.of("misprint")}


def finding(verification, number, status):
    (found,) = (c for c in verification.equations if (c.number, c.status) == (number, status))
    return found


def test_every_numbered_equation_has_a_finding(paper):
    assert list(dict.fromkeys(c.number for c in paper.equations)) == [str(k) for k in range(1, 44)]
    assert {c.status for c in paper.equations} == set(FINDING_STATUSES)


def test_the_misprints_are_these_and_no_others(paper):
    assert {n for n, _ in misprints(paper)} == set(MISPRINTS)
    assert misprints(paper) == set(CORRECT)
    for number, words in MISPRINTS.items():
        assert words in finding(paper, number, "misprint").note


def test_the_right_equations_tell_each_misprint(paper):
    tells = {c.number: set(c.agrees_with) for c in paper.of("misprint")}
    assert {"14", "15"} <= tells["18"]
    assert {"15", "22"} <= tells["20"]
    assert tells["9"] == {"11", "12"}
    assert "15" in tells["13"]
    assert tells["34"] == {"35"}
    assert "38" in tells["41"]


@pytest.mark.parametrize(("number", "name"), CORRECT)
def test_a_corrected_misprint_is_found_no_more(number, name):
    corrected = verify(printed_with(number, name, CORRECT[number, name]))
    assert misprints(corrected) == set(CORRECT) - {(number, name)}


def first_of_each_equation_fast(damage):
    """The cases, with all but the first of an equation marked slow."""
    numbers = [case[0] for case in damage]
    return [pytest.param(*c, marks=[pytest.mark.slow] if c[0] in numbers[:k] else []) for k, c in enumerate(damage)]


@pytest.mark.parametrize(("number", "name", "old", "new"), first_of_each_equation_fast(DAMAGE))
def test_damage_is_reported_at_exactly_its_equation(number, name, old, new):
    damaged = verify(printed_with(number, name, PRINTED_EQUATIONS[number][name].subs(old, new)))
    assert misprints(damaged) == set(CORRECT) | {(number, name)}
    assert all(c.note for c in damaged.of("misprint"))


def test_the_corrected_equations_hang_together():
    corrected = {n: {k: CORRECT.get((n, k), e) for k, e in PRINTED_EQUATIONS[n].items()} for n in PRINTED_EQUATIONS}
    for relation in EQUATION_RELATIONS:
        assert all(is_zero(r) for r in relation.residuals(corrected).values()), relation.sentence


def test_the_lagrangian_lacks_a_constant_only(paper):
    assert "2 m R g" in finding(paper, "1", "match").note


def test_the_assumptions_are_named_where_they_enter(paper):
    entered = {(c.number, c.assumption) for c in paper.of("assumption")}
    assert entered == {
        ("1", "rotor_inertia"), ("1", "rotor_speed"), ("1", "body_inertia"), ("7", "motor_circuit"),
        ("10", "two_geared_motors"), ("12", "gear_ratio_in_back_emf"), ("13", "ground_friction_reaction"),
        ("26", "encoder"),
    }  # fmt: skip


def test_the_ground_frictions_reaction_is_worth_2_f_w_and_reaches_the_body_row(paper):
    note = finding(paper, "13", "assumption").note
    assert "takes body" in note and "−2 f_w θ̇w" in note and "(15)" in note and "(14)" not in note


def test_a_paper_without_the_grounds_reaction_would_make_the_other_choice():
    other = -alpha * V + 2 * beta * (dw - dp)
    result = verify(printed_with("13", "F_θp", other))
    assert "takes none" in finding(result, "13", "assumption").note
    assert "15" in {n for n, _ in misprints(result)}  # which would still be printed with the reaction


def test_what_cannot_be_read_is_said_to_be_so(paper):
    assert {c.number for c in paper.of("not_available")} == {"26", "33"}
    assert "column 5 or 6 or 7" in finding(paper, "26", "not_available").note
    assert "θ̇w" in finding(paper, "26", "match").note


def test_the_length_is_contradicted_by_three_parameters_that_agree(paper):
    length = next(c for c in paper.parameters if c.name == "L")
    assert (length.status, length.printed, length.derived) == ("contradiction", "1.8 m", "0.716 m")
    assert [float(v) for v in re.findall(r"needs (\S+)", length.note)] == pytest.approx([0.716] * 3, abs=6e-4)


def test_what_the_parameter_list_leaves_out_follows_from_the_reference(paper):
    missing = {c.name: c for c in paper.parameters if c.status == "missing"}
    assert missing["J_m"].derived == "0.00751 kg m²" and "0.105" in missing["J_m"].note
    assert missing["f_w"].derived == "0.1 N m s/rad"


def test_the_back_emf_constant_is_not_the_torque_constant(paper):
    check = next(c for c in paper.parameters if c.name == "K_b")
    assert check.status == "contradiction" and "0.833" in check.note and "0.722" in check.note


def test_everything_else_in_the_parameter_list_agrees(paper):
    agreeing = {c.name for c in paper.parameters if c.status == "match" and not c.name.startswith("Table")}
    assert agreeing == {"m", "M", "R", "epsilon", "f_m", "K_t", "R_m", "J_w", "J_b", "X1", "X3", "X4", "X5", "X7"}


def test_three_percentages_do_not_follow_from_their_estimates(paper):
    wrong = {c.name: (c.status, c.derived) for c in paper.parameters if "Table" in c.name and c.status != "match"}
    assert wrong == {
        "Table 3, case B, X3": ("misprint", "106.33 %"),
        "Table 3, case B, X4": ("misprint", "101.17 %"),
        "Table 2, aggressive command, X5": ("contradiction", "0.18672 %"),
    }


def test_the_result_is_plain_json(paper):
    data = to_json(paper)
    assert data["schema"] == 1
    assert set(data["equations"][0]) >= {"number", "status", "printed", "derived", "note", "how", "assumption"}
    assert '"misprint"' in dumps(data)


def test_the_page_is_what_the_code_makes(paper):
    stored = ROOT / "docs" / "paper.md"
    assert stored.read_text(encoding="utf-8") == page_text(paper), "run `wheelpend verify --page docs/paper.md`"


def test_the_terminal_shows_every_misprint_with_its_correction(paper, capsys):
    print_verification(paper)
    printed = capsys.readouterr().out
    for checked in paper.of("misprint"):
        assert checked.printed in printed and checked.derived in printed


def test_what_a_simulation_needs_and_the_paper_does_not_state_is_missing(paper):
    missing = {c.name for c in paper.parameters if c.status == "missing"}
    assert missing >= {"duration", "signal behind the derivative gain", "number of draws", "J_m", "f_w"}
    assert "integration step" not in missing
