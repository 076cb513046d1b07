"""Deriving stays cheap: counted in calls, which are the same on every machine."""

import cProfile
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from sympy.core.cache import clear_cache

import derive
from derive import algebra, base_equations, effects, grouping, plants
from derive.functions import symbol
from derive.kernels.arguments import trig_arguments_of
from derive.kernels.motion import free_motion_kernel

PLANT = "wheel_pendulum"
FIFTEEN = (
    "coulomb_drive", "viscous_asymmetry", "stribeck_drive", "quadratic_drive", "cogging",
    "ground_viscous", "rolling_resistance", "slope", "wheel_runout", "air_drag",
    "com_offset", "body_damping", "tether_spring", "voltage_offset", "imu_bias",
)  # fmt: skip
SLOW = ("expand", "simplify", "nsimplify", "cancel", "together", "integrate", "solve", "linsolve")


@pytest.fixture
def afresh():
    """A function that forgets all that was derived before, and is called once."""

    def forget():
        clear_cache()
        for part in (algebra, base_equations, grouping, plants):
            for thing in vars(part).values():
                getattr(thing, "cache_clear", lambda: None)()

    forget()
    return forget


def text_with(names):
    return derive.render(derive.compose(PLANT, {}, names))


def calls_in(task):
    """How many Python functions a task calls."""
    profile = cProfile.Profile(builtins=False)
    profile.runcall(task)
    return sum(entry.callcount for entry in profile.getstats())


def test_fifteen_effects_take_few_of_sympys_slow_steps(afresh, monkeypatch):
    steps = Counter()

    def counted(name, function):
        return lambda *given, **options: (steps.update([name]), function(*given, **options))[1]

    for name in SLOW:
        monkeypatch.setattr(sp, name, counted(name, getattr(sp, name)))
    monkeypatch.setattr(sp.Expr, "diff", counted("diff", sp.Expr.diff))
    text_with(FIFTEEN)
    assert steps["expand"] < 100 and steps["diff"] < 800
    assert steps["nsimplify"] < 30 and steps["cancel"] < 30 and steps["simplify"] <= 2
    assert not {"together", "integrate", "solve", "linsolve"} & set(steps)


def test_twice_as_many_effects_cost_twice_as_much(afresh, monkeypatch):
    cost = {}
    text_with([])  # whatever is loaded once
    for size in (6, 12, 24):
        names = [f"drag_{n:02d}" for n in range(size)]
        for name in names:
            monkeypatch.setitem(effects.USER_EFFECTS, name, replace(effects.find("quadratic_drive"), name=name))
        afresh()
        cost[size] = calls_in(lambda names=names: text_with(names))
    assert cost[24] - cost[12] < 2.6 * (cost[12] - cost[6])  # it would be 4 times as much where each meets each


def test_a_plants_equations_are_derived_once_for_all_its_models(afresh, monkeypatch):
    derived, known = [], base_equations.derive_equations
    monkeypatch.setattr(base_equations, "derive_equations", lambda plant: (derived.append(plant), known(plant))[1])
    for names in ((), ("coulomb_drive",), ("slope",), ("coulomb_drive", "com_offset")):
        derive.compose(PLANT, {}, names)
    assert len(derived) == 1


def test_the_whole_library_is_found_without_searching_every_pair(afresh, monkeypatch):
    solved, known = [], algebra.row_echelon_form
    monkeypatch.setattr(algebra, "row_echelon_form", lambda columns: (solved.append(columns), known(columns))[1])
    found = derive.library_model(PLANT, {}).relations
    assert found.twins and found.contained and len(solved) < 2 * len(effects.EFFECT_LIBRARY)


@pytest.mark.parametrize("gives", [("backlash", "wheel_slip"), ("backlash", "slosh", "wheel_slip")])
def test_several_gives_at_once_have_their_inverse_mass_matrix_in_closed_form(gives):
    machine = derive.compose(PLANT, {}, gives)
    kernel = free_motion_kernel(machine)
    generator = np.random.default_rng(1)
    names = {s.name for row in machine.residual for s in row.free_symbols} | set(machine.parameters)
    known = {name: generator.uniform(0.5, 2.0) for name in sorted(names)}
    scope = {n: known.get(n, 0.0) for n in map(str, (*machine.states, *machine.added_states, machine.plant.input))}
    scope |= {"math": math, "_sign": np.sign, "_step": lambda x: float(x > 0)}
    for angle, turn in trig_arguments_of(machine).items():
        value = float(angle.subs({symbol(n): v for n, v in known.items()}))
        scope |= {f"sin_{turn}": math.sin(value), f"cos_{turn}": math.cos(value)}
    scope["parameters"] = [known[name] for name in machine.parameters]
    exec("\n".join((*kernel.unpack, *kernel.steps, *kernel.results)), scope)
    accelerations = [c.ddq for c in machine.plant.moving]
    mass = algebra.jacobian(machine.residual, accelerations).subs({symbol(n): v for n, v in known.items()})
    size = range(len(accelerations))
    mobility = np.array([[scope[f"mobility_{i}_{j}"] for j in size] for i in size])
    np.testing.assert_allclose(mobility @ np.array(mass, dtype=float), np.eye(len(accelerations)), atol=1e-9)
