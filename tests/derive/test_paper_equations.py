"""The equations of Peng, Cheng and Tsai (2023) that the derivation uses, typed by hand from the page."""

import pytest
import sympy as sp

import derive
from derive.functions import symbol
from derive.lagrange import derive_equations

m, M, L, R, g, J_w, J_b, J_m, epsilon = sp.symbols("m M L R g J_w J_b J_m epsilon", positive=True)
K_t, K_b, R_m, f_m, f_w, alpha = sp.symbols("K_t K_b R_m f_m f_w alpha", positive=True)
w, p, dw, dp, ddw, ddp, V = (symbol(s) for s in (
    "theta_w", "theta_p", "dtheta_w", "dtheta_p", "ddtheta_w", "ddtheta_p", "v_in"))  # fmt: skip
X1, X2, X3, X4, X5, X6, X7 = (symbol(f"X{k}") for k in range(1, 8))
cos, sin = sp.cos, sp.sin


@pytest.fixture(scope="module")
def plant():
    robot = derive.plants.find("wheel_pendulum").build(derive.plants.complete_assumptions("wheel_pendulum", {}))
    return robot


@pytest.fixture(scope="module")
def flat():
    return {symbol("track_slope"): 0, symbol("com_angle"): 0, symbol("payload"): 0}


@pytest.fixture(scope="module")
def model():
    return derive.compose("wheel_pendulum", {}, [])


def same(derived, printed):
    return sp.simplify(sp.expand(derived - printed)) == 0


def test_the_lagrangian_is_equation_1_up_to_the_wheels_constant_potential(plant, flat):
    printed = (
        m * R**2 * dw**2 + M * R**2 * dw**2 / 2 + M * R * dw * dp * L * cos(p) + M * dp**2 * L**2 / 2 + J_w * dw**2
        + J_b * dp**2 / 2 + epsilon**2 * J_m * dw**2 - 2 * epsilon**2 * J_m * dw * dp + epsilon**2 * J_m * dp**2
        - M * g * R - M * g * L * cos(p)
    )  # fmt: skip
    assert same(derive_equations(plant).lagrangian.subs(flat), printed - 2 * m * g * R)


def test_the_wheel_row_is_equation_3(plant, flat):
    printed = (
        ((2 * m + M) * R**2 + 2 * J_w + 2 * epsilon**2 * J_m) * ddw
        + (M * L * R * cos(p) - 2 * epsilon**2 * J_m) * ddp - M * L * R * dp**2 * sin(p)
    )  # fmt: skip
    assert same(derive_equations(plant).inertia[0].subs(flat), printed)


def test_the_body_row_is_equation_4(plant, flat):
    printed = (
        (M * L * R * cos(p) - 2 * epsilon**2 * J_m) * ddw + (M * L**2 + J_b + 2 * epsilon**2 * J_m) * ddp
        - M * g * L * sin(p)
    )  # fmt: skip
    assert same(derive_equations(plant).inertia[1].subs(flat), printed)


def test_the_generalised_forces_are_equations_11_and_13(plant, flat):
    beta = epsilon * K_t * K_b / R_m + f_m
    drive = 2 * epsilon * K_t / R_m * V - 2 * (beta + f_w) * dw + 2 * beta * dp
    wheel, body = (f.subs(flat) for f in derive_equations(plant).force)
    assert same(wheel, drive)
    assert same(body, -drive)


def test_the_equivalent_parameters_are_equation_18_with_the_gear_ratio_squared_in_x2(model):
    beta = alpha * K_b / 2 + f_m  # equation 12 with K_t = alpha R_m / (2 epsilon)
    printed = (
        ((2 * m + M) * R**2 + 2 * J_w) / alpha, 2 * epsilon**2 * J_m / alpha, M * L * R / alpha,
        (M * L**2 + J_b) / alpha, M * g * L / alpha, 2 * (beta + f_w) / alpha, 2 * beta / alpha,
    )  # fmt: skip
    assert model.grouping.names == ("X1", "X2", "X3", "X4", "X5", "X6", "X7")
    assert all(same(d, e) for d, e in zip(model.grouping.definitions, printed, strict=True))


def test_the_wheel_row_is_equation_19(model):
    printed = (X1 + X2) * ddw + (X3 * cos(p) - X2) * ddp - X3 * dp**2 * sin(p) + X6 * dw - X7 * dp
    assert same(model.residual[0], printed - V)


def test_the_body_row_is_equation_20_with_the_sign_of_gravity_corrected(model):
    printed = -(X3 * cos(p) - X2) * ddw - (X4 + X2) * ddp + X5 * sin(p) + X6 * dw - X7 * dp
    assert same(model.residual[1], V - printed)


def test_the_regressor_is_equations_22_and_23(model):
    f13, f23, f25 = cos(p) * ddp - sin(p) * dp**2, -cos(p) * ddw, sin(p)
    printed = sp.Matrix([
        [ddw, ddw - ddp, f13, 0, 0, dw, -dp],
        [0, ddw - ddp, f23, -ddp, f25, dw, -dp],
    ])  # fmt: skip
    assert sp.expand(model.regressor.phi - printed) == sp.zeros(2, 7)
    assert model.regressor.tau == sp.Matrix([V, V])


def test_the_pieces_without_accelerations_are_equation_26(model):
    phi2 = sp.Matrix([[w, w - p, 0, 0, 0, 0, 0], [0, w - p, 0, -p, 0, 0, 0]])
    phi1 = sp.Matrix([[0, 0, cos(p) * dp, 0, 0, w, -p], [0, 0, -cos(p) * dw, 0, 0, w, -p]])
    phi0 = sp.Matrix([[0] * 7, [0, 0, -sin(p) * dp * dw, 0, sin(p), 0, 0]])
    derived = model.regressor
    assert (derived.phi2, derived.phi1, derived.phi0) == (phi2, phi1, phi0)


def test_without_the_ground_frictions_reaction_the_body_row_carries_x7_in_front_of_the_wheel_speed():
    rows = derive.compose("wheel_pendulum", {"ground_friction_reaction": "none"}, []).residual
    assert sp.expand(rows[1]).coeff(dw) == -X7
    assert sp.expand(rows[0]).coeff(dw) == X6


def test_counting_the_rotors_speed_against_the_world_changes_no_equation():
    world = derive.compose("wheel_pendulum", {"rotor_speed": "world"}, [])
    assert world.residual == derive.compose("wheel_pendulum", {}, []).residual
    assert same(world.grouping.definitions[1], 2 * epsilon * (epsilon - 1) * J_m / alpha)


def test_without_rotor_inertia_x2_is_gone_and_the_others_keep_their_names():
    model = derive.compose("wheel_pendulum", {"rotor_inertia": False}, [])
    assert model.grouping.names == ("X1", "X3", "X4", "X5", "X6", "X7")


def test_a_slope_is_written_with_x1_and_the_known_constants():
    row = derive.compose("wheel_pendulum", {}, ["slope"]).residual[0]
    angle, known = symbol("slope.angle"), {s: symbol(s.name) for s in (R, g, J_w, alpha)}
    weight = (X1 * R / R - 2 * J_w / alpha) * g / R  # (2m + M) g R / alpha
    assert same(row.subs({ddw: 0, ddp: 0, dw: 0, dp: 0, V: 0}), (weight * sin(angle)).subs(known))


def test_a_centre_of_mass_off_the_line_and_a_biased_pitch_sensor_are_the_same_model():
    body = derive.compose("wheel_pendulum", {}, ["com_offset"])
    shifted = [r.subs(p, p - symbol("com_offset.angle")) for r in body.residual]
    assert [
        sp.expand(s - r) for s, r in zip(shifted, derive.compose("wheel_pendulum", {}, []).residual, strict=True)
    ] == [0, 0]


def test_the_same_text_comes_out_for_every_hash_seed():
    import subprocess
    import sys

    code = "import derive; print(derive.render(derive.compose('wheel_pendulum', {}, ['coulomb_drive', 'slope'])))"
    texts = {
        subprocess.run([sys.executable, "-c", code], env={"PYTHONHASHSEED": seed, "PATH": ""}, capture_output=True,
                       text=True, check=True).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(texts) == 1
