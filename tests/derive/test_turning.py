"""The robot that turns: the planar one is its special case, and it obeys the published equations."""

import pytest
import sympy as sp

from derive.functions import symbol
from derive.model import compose
from wheelpend.kernels import load as kernels

TURNING = {"planar": False}


def straight() -> dict:
    return {symbol(n): 0 for n in ("psi", "dpsi", "ddpsi")} | {symbol(n): symbol("v_in") for n in ("v_left", "v_right")}


@pytest.mark.parametrize(
    "choices", [{}, {"ground_friction_reaction": "none"}, {"rotor_speed": "world"}, {"rotor_inertia": False}]
)
def test_the_planar_robot_is_the_special_case_of_one_that_turns(choices):
    planar, turning = compose("wheel_pendulum", choices, []), compose("wheel_pendulum", {**choices, **TURNING}, [])
    names = dict(zip(planar.grouping.names, planar.grouping.definitions, strict=True))
    own = dict(zip(turning.grouping.names, turning.grouping.definitions, strict=True))
    assert all(sp.expand(own[n] - d) == 0 for n, d in names.items())  # the same parameters under the same names
    for row, flat in zip(turning.residual, planar.residual, strict=False):
        assert sp.expand(row.subs(straight()) - flat) == 0
    assert turning.residual[2].subs(straight()) == 0


def test_the_turning_robot_obeys_the_published_equations():
    """Kim and Kwon 2017, Int. J. Control Autom. Syst. 15, (1)-(3), in this project's letters."""
    rows = compose("wheel_pendulum", TURNING, []).residual
    q, dq, dpsi = symbol("theta_p"), symbol("dtheta_p"), symbol("dpsi")
    X3, X9 = symbol("X3"), symbol("X9")
    assert rows[0].coeff(dpsi, 2) == -X3 * sp.sin(q)  # the centripetal force of the leaning body
    assert sp.simplify(rows[1].coeff(dpsi, 2) + X9 * sp.sin(2 * q)) == 0
    assert sp.simplify(rows[2].coeff(dpsi).coeff(dq) - 2 * X9 * sp.sin(2 * q)) == 0
    assert rows[2].coeff(dpsi).coeff(symbol("dtheta_w")) == X3 * sp.sin(q)


def test_a_difference_of_inertias_may_be_negative():
    module = kernels.library_module("wheel_pendulum", TURNING)
    assert module.SIGNED == ("X9",) and kernels.library_module("wheel_pendulum", {}).SIGNED == ()
