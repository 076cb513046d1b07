"""The variables of an FMU, in the order of their value references: those of instance.h."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import derive
from wheelpend.export.exported_model import ExportedModel
from wheelpend.export.fmu_units import FmiUnit, fmi_unit
from wheelpend.model.equations import derived_model

LAGGING_INPUT = "the input behind the actuator's lag"


@dataclass(frozen=True)
class FmuVariable:
    """A real variable as modelDescription.xml has it."""

    name: str
    reference: int
    index: int  # among those that are declared, from 1 on
    causality: str
    variability: str
    initial: str
    description: str
    unit: str = ""
    start: str | None = None
    state: FmuVariable | None = None  # whose derivative it is
    depends: tuple[FmuVariable, ...] = ()
    least: str | None = None  # value that it may have
    jumps: bool = False  # True of a state that an event may change


@dataclass(frozen=True)
class FmuVariables:
    """All variables by kind."""

    time: FmuVariable
    states: tuple[FmuVariable, ...]
    slopes: tuple[FmuVariable, ...]
    inputs: tuple[FmuVariable, ...]
    outputs: tuple[FmuVariable, ...]
    parameters: tuple[FmuVariable, ...]
    commands: tuple[FmuVariable, ...]  # before the start
    directions: tuple[FmuVariable, ...]
    reserves: tuple[FmuVariable, ...]

    def all(self) -> tuple[FmuVariable, ...]:
        """In the order of modelDescription.xml."""
        return (self.time, *self.states, *self.slopes, *self.inputs, *self.outputs, *self.parameters, *self.commands,
                *self.directions, *self.reserves)  # fmt: skip

    def units(self) -> tuple[FmiUnit, ...]:
        """Units of all variables, by their names."""
        found = {v.unit: fmi_unit(v.unit) for v in self.all() if v.unit}
        return tuple(sorted({u.name: u for u in found.values()}.values()))


def fmu_variables(exported: ExportedModel) -> FmuVariables:
    """The variables of a model's FMU."""
    return _Declaration(exported).declared()


class _Declaration:
    """Counts references, of which some are left out, and indices of what is declared."""

    def __init__(self, exported: ExportedModel) -> None:
        self.exported, self.module = exported, exported.module
        self.reference = self.index = 0

    def declared(self) -> FmuVariables:
        """All variables, in the order of instance.h."""
        e, m = self.exported, self.module
        inputs, surfaces = m.INPUTS[: e.inputs], range(1, m.SURFACES + 1)
        time = self.add("time", "independent", "continuous", "", "time since the log's first sample", "s")
        known = self.state_units()
        states = [self.add(f"state.{n}", "local", "continuous", "exact", text, unit, 0.0) for n, unit, text in known]
        stopped = {int(place) for place in m.RATES} if m.SURFACES else set()
        states = [replace(s, jumps=i in stopped) for i, s in enumerate(states)]
        slopes = [
            self.add(f"der({s.name})", "local", "continuous", "calculated", f"its time derivative: {s.description}",
                     per_second(s.unit), state=s)
            for s in states
        ]  # fmt: skip
        given = [self.add(n, "input", "continuous", "", "input", e.model.plant_signature.input_unit, 0.0)
                 for n in inputs]  # fmt: skip
        self.reference += not inputs
        outputs = self.outputs(states)
        parameters = self.parameters()
        commands = self.commands(inputs)
        directions = [self.add(f"friction.direction[{i}]", "local", "discrete", "calculated",
                               "of a surface with dry friction: -1 or 1 as it slips, 0 while it sticks")
                      for i in surfaces]  # fmt: skip
        self.reference += not m.SURFACES
        reserves = [self.add(f"friction.reserve[{i}]", "local", "continuous", "calculated",
                             "event indicator: slip speed as a surface slips, what holds it as it sticks")
                    for i in range(1, 2 * m.SURFACES + 1)]  # fmt: skip
        found = FmuVariables(time, tuple(states), tuple(self.with_dependencies(slopes, states, given)), tuple(given),
                             tuple(outputs), tuple(parameters), tuple(commands), tuple(directions),
                             tuple(reserves))  # fmt: skip
        return found

    def add(
        self, name: str, causality: str, variability: str, initial: str, description: str, unit: str = "",
        start: float | None = None, state: FmuVariable | None = None, depends: tuple[FmuVariable, ...] = (),
    ) -> FmuVariable:  # fmt: skip
        """The next variable."""
        self.index += 1
        shown = None if start is None else repr(finite(start))
        made = FmuVariable(name, self.reference, self.index, causality, variability, initial, description,
                           fmi_unit(unit).name if unit and unit != "1" else "", shown, state, depends)  # fmt: skip
        self.reference += 1
        return made

    def state_units(self) -> list[tuple[str, str, str]]:
        """Name, unit and description of each state."""
        m, model = self.module, self.exported.model
        moving = derived_model(model).plant.moving
        units = {str(c.q): (c.unit, f"coordinate of the {c.row} row") for c in moving}
        units |= {str(c.dq): (f"{c.unit}/s", f"rate of {c.q}") for c in moving}
        remembered = [n for n in m.VARIABLES if n not in units]
        sizes = m.HYSTERESIS_SIZES
        units |= {n: (m.UNITS[sizes[i]], "a force with a memory") for i, n in enumerate(remembered)}
        found = [(n, *units[n]) for n in m.VARIABLES]
        lag = [(f"{m.INPUT}_acting", model.plant_signature.input_unit, LAGGING_INPUT)] if m.LAG >= 0 else []
        return found + lag

    def with_dependencies(
        self, slopes: list[FmuVariable], states: list[FmuVariable], inputs: list[FmuVariable]
    ) -> list[FmuVariable]:
        """Slopes with what they depend on: that of a coordinate is its rate, the others are taken to depend on all."""
        by_name = {s.name: s for s in states}
        found = []
        for slope in slopes:
            prefix, _, name = slope.state.name.partition(".") if slope.state else ("", "", "")
            rate = by_name.get(f"{prefix}.d{name}")
            found.append(replace(slope, depends=(rate,) if rate else (*states, *inputs)))
        return found

    def outputs(self, states: list[FmuVariable]) -> list[FmuVariable]:
        """What the sensors read."""
        channels = {c.name: c for c in self.exported.model.plant_signature.channels}
        return [
            self.add(n, "output", "continuous", "calculated", "reading of the sensor",
                     channels[n].unit if n in channels else "", depends=tuple(states))
            for n in self.module.OUTPUTS
        ]  # fmt: skip

    def parameters(self) -> list[FmuVariable]:
        """Identified values and constants; the unknown forces of the filters keep their places and are not declared."""
        m, found = self.module, []
        for place, name in enumerate(m.PARAMETERS):
            if name in m.MISSING_FORCES:
                self.reference += 1
                continue
            unit = m.UNITS[place] if place < len(m.UNITS) else ""
            value = float(self.exported.parameters[place])
            made = self.add(structured(name), "parameter", "tunable", "exact", self.described(name), unit, value)
            found.append(replace(made, least="0.0") if place in (m.DELAY, m.SENSOR_DELAY) else made)
        return found

    def described(self, name: str) -> str:
        """What a parameter belongs to, and its standard error."""
        effect, dot, _ = name.partition(".")
        what = derive.effects.find(effect).sentence if dot and effect in self.exported.model.effects else "of the plant"
        sigma = self.exported.sigma.get(name)
        return f"{what} Standard error {sigma:.2g}." if sigma else what

    def commands(self, inputs: Sequence[str]) -> list[FmuVariable]:
        """Commands before the start, where a delay lets them act after it."""
        unit, found = self.exported.model.plant_signature.input_unit, []
        if self.module.DELAY >= 0:
            for j in range(1, self.exported.commands + 1):
                said = f"in co-simulation, the input commanded {j} periods before the start"
                found += [self.add(f"{n}_before[{j}]", "parameter", "fixed", "exact", said, unit, 0.0) for n in inputs]
        else:
            self.reference += self.exported.commands * max(self.exported.inputs, 1)
        return found


def finite(value: float) -> float:
    """A number, for infinity the largest that there is: FMI has no other."""
    return value if math.isfinite(value) else math.copysign(sys.float_info.max, value)


def per_second(unit: str) -> str:
    """Unit of a time derivative."""
    if unit.endswith("/s"):
        return f"{unit}²"
    return f"{unit} s" if "/" in unit else f"{unit}/s"


def structured(name: str) -> str:
    """A name as the naming convention of FMI lets it be: parts that are no identifiers in quotes."""
    return ".".join(p if re.fullmatch(r"[A-Za-z_][A-Za-z_0-9]*", p) else f"'{p}'" for p in name.split("."))
