"""State-space pieces of a model: free motion, its Jacobians, dry friction, sensors, regressor."""

from __future__ import annotations

import math
from typing import NamedTuple

import sympy as sp

from derive.functions import symbol
from derive.model import named, slip_row
from derive.printing import Kernel, Target, kernel
from derive.records import Memory, Model, Relations


class Signal(NamedTuple):
    """A quantity to be filtered for the regression: its expression and how often it is differentiated."""

    value: sp.Expr
    derivatives: int  # 0, 1 or 2
    held: bool  # whether it is constant between samples, as the input is


class MemoryCode(NamedTuple):
    """A force with a memory: its name, its index among the variables, and its path by the moving coordinates."""

    name: str
    place: int
    path: tuple[tuple[float, str, int], ...]  # weight, coordinate, its index among the variables
    value: Kernel
    jacobian: Kernel


class Code(NamedTuple):
    """Everything the templates need; strings and numbers only."""

    states: tuple[str, ...]  # coordinates and rates
    variables: tuple[str, ...]  # the same, then what effects add
    slopes: tuple[str, ...]  # time derivative of each variable but the forces with a memory
    rates: tuple[int, ...]  # index of the rate of each moving coordinate among the variables
    memories: tuple[MemoryCode, ...]
    accelerations: tuple[str, ...]
    outputs: tuple[str, ...]
    rows: tuple[str, ...]
    late: tuple[int, ...]  # indices of the outputs that are delayed
    sensor_delay: int  # index of their delay among the parameters, or -1
    moments: tuple[int, ...]  # indices of the parameters that are times
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    absent: tuple[str, ...]  # value of each parameter while it has no influence, as an expression
    relations: Relations
    fitted: int  # so many of the parameters, from the first, have sensitivities
    delay: int  # index of the input delay, or -1
    lag: int  # index of the time constant of the input's lag, or -1
    origin: int  # index of the angle at the log's first sample, or -1
    input: str  # argument of the kernels: the input, or a row of several
    inputs: tuple[str, ...]  # columns; none where nothing drives the machine
    directions: tuple[str, ...]  # of the surfaces with dry friction
    slips: tuple[tuple[float, ...], ...]
    dry_sizes: tuple[int, ...]  # indices of parameters; all surfaces are smooth where these are zero
    needs: dict[str, tuple[str, ...]]  # constants without which a parameter has no meaning
    linear: tuple[str, ...]  # parameters of the regressor
    controlled: tuple[int, int]  # outputs that the controller sees: value, rate; -1 for what no sensor reads
    reads: tuple[tuple[float, ...], ...]  # what each output reads of the states while no effect touches the sensors
    falls: int  # index of the output that must stay within ±π/2, or -1
    ports: dict[str, tuple[float, ...]]  # each port's coordinate as weights on the coordinates
    driven: bool
    signed: tuple[str, ...]  # own parameters that may be negative: differences of physical constants
    signals: tuple[tuple[int, bool], ...]  # derivatives, held
    unmeasured: tuple[int, ...]  # indices of the rates that no sensor reads
    kernels: dict[str, Kernel]


def generate_code(model: Model) -> Code:
    """Turn a model into the text of its kernels."""
    signals = filtered_signals(model)
    outputs = tuple(c.name for c in model.plant.channels)
    names = model.parameters
    variables = variables_of(model)
    return Code(
        states=tuple(s.name for s in model.states),
        variables=variables,
        slopes=slopes_of(model),
        rates=tuple(variables.index(c.dq.name) for c in model.plant.moving),
        memories=tuple(memory_code(model, m) for m in model.memories),
        late=tuple(outputs.index(name) for name in model.late),
        sensor_delay=names.index(model.sensor_delay) if model.sensor_delay else -1,
        moments=tuple(names.index(name) for name in model.moments),
        accelerations=tuple(c.ddq.name for c in model.plant.moving),
        outputs=outputs,
        rows=tuple(c.row for c in model.plant.coordinates),
        parameters=names,
        units=tuple(p.unit for p in (*model.fitted, *model.constants)),
        absent=tuple(
            "math.inf" if math.isinf(v) else repr(v) for v in (*model.absent, *(1.0 for _ in model.constants))
        ),
        relations=model.relations or Relations({}, {}, {}),
        fitted=len(model.fitted),
        delay=names.index(model.delay) if model.delay else -1,
        lag=names.index(model.lag) if model.lag else -1,
        origin=names.index("origin") if "origin" in names else -1,
        input=input_argument(model),
        inputs=tuple(u.name for u in model.plant.inputs) if model.plant.driven else (),
        directions=tuple(s.direction.name for s in model.surfaces),
        slips=tuple(s.slip for s in model.surfaces),
        dry_sizes=tuple(names.index(name) for name in dry_sizes(model)),
        needs=needed_constants(model),
        linear=tuple(s.name for s in model.regressor.parameters),
        controlled=(place_of(outputs, model.plant.controlled[0]), place_of(outputs, model.plant.controlled[1])),
        reads=ideal_readings(model),
        falls=place_of(outputs, model.plant.falls),
        ports={p.name: slip_row(model.plant, p.name)[: len(model.plant.coordinates)] for p in model.plant.ports},
        driven=model.plant.driven,
        signed=tuple(n for n, d in named(model.grouping) if not positive(d)),
        signals=tuple((s.derivatives, s.held) for s in signals),
        unmeasured=unmeasured_rates(model),
        kernels={
            "free_motion": free_motion(model),
            "residual_jacobian": residual_jacobian(model),
            "dry_law": dry_law(model),
            "drive": kernel([Target("driven", model.drive)], scalar_sources(model)),
            "drive_jacobian": drive_jacobian(model),
            "outputs": outputs_kernel(model),
            "output_jacobian": output_jacobian(model),
            "regressor": regressor_kernel(model),
            "regressor_parts": regressor_parts(model),
            "energy_parts": energy_parts(model),
            "signal_rates": signal_rates(model, signals),
            "signals": kernel([Target(f"signal[{n}]", s.value) for n, s in enumerate(signals)], directed(model)),
            "assemble": assemble(model, signals),
        },
    )


def positive(definition: sp.Expr) -> bool:
    """Whether a parameter is a sum of products of physical constants, all of which are positive."""
    return all(term.is_positive for term in sp.Add.make_args(sp.expand(definition)))


def place_of(names: tuple[str, ...], name: str) -> int:
    """Index of a name, -1 for none."""
    return names.index(name) if name else -1


def ideal_readings(model: Model) -> tuple[tuple[float, ...], ...]:
    """What each output reads of the states while no effect touches the sensors, as constant weights."""
    readings = sp.Matrix([c.reading for c in model.plant.channels])
    weights = readings.jacobian(list(model.states))
    at_rest = readings.subs(dict.fromkeys(model.states, 0))
    if weights.free_symbols or any(at_rest):
        raise ValueError(f"{model.plant.name}: every sensor must read a sum of coordinates or of rates, not {readings}")
    return tuple(tuple(float(w) for w in row) for row in weights.tolist())


def variables_of(model: Model) -> tuple[str, ...]:
    """Names of everything that varies in time: coordinates and rates, then what effects add."""
    return tuple(s.name for s in (*model.states, *model.inner))


def slopes_of(model: Model) -> tuple[str, ...]:
    """Names of the time derivatives of the variables, those of forces with a memory apart."""
    slope = {c.q.name: c.dq.name for c in model.plant.moving} | {c.dq.name: c.ddq.name for c in model.plant.moving}
    return tuple(slope[name] for name in variables_of(model) if name in slope)


def memory_code(model: Model, memory: Memory) -> MemoryCode:
    """A force with a memory as text; its derivatives are by the force before, by the path, then by the parameters."""
    variables = variables_of(model)
    pairs = zip(memory.weights, model.plant.moving, strict=True)
    table = sources(model, **{s.name: s.name for s in (memory.before, memory.path)})
    slopes = [Target("by_before", memory.law.diff(memory.before)), Target("by_path", memory.law.diff(memory.path))]
    own = [(n, memory.law.diff(symbol(p.name))) for n, p in enumerate(model.fitted)]
    return MemoryCode(
        memory.force.name,
        variables.index(memory.force.name),
        tuple((w, c.q.name, variables.index(c.q.name)) for w, c in pairs if w),
        kernel([Target("force", memory.law)], table),
        kernel([*slopes, *(Target(f"by_parameter[stage, row, {n}]", s) for n, s in own if s != 0)], table),
    )


def needed_constants(model: Model) -> dict[str, tuple[str, ...]]:
    """Constants in what multiplies each effect parameter alone, or what the effect frees, where there are any."""
    known = [c.name for c in model.constants if c.name != "origin"]
    table: dict[str, tuple[str, ...]] = {}
    for effect in model.effects:
        own = set(effect.symbols.values())
        others = {s: 0 for e in model.effects for p, s in zip(e.parameters, e.symbols.values(), strict=True)
                  if p.absent == 0.0 and s not in own}  # fmt: skip
        inner = model.plant.inner.get(effect.frees)
        touched = (*own, *((inner.q, inner.dq, inner.ddq) if inner else ()))
        slopes = [row.subs(others).diff(s) for row in model.residual for s in touched]
        inside = set().union(*(slope.free_symbols for slope in slopes))
        wanted = tuple(c for c in known if symbol(c) in inside)
        table |= {name: wanted for name in effect.full_names if wanted}
    return table


def sources(model: Model, **extra: str) -> dict[str, str]:
    """Where a kernel finds each symbol among its arguments."""
    table = {"t": "t", **input_sources(model, "voltage")}
    table |= {name: f"state[{n}]" for n, name in enumerate(variables_of(model))}
    table |= {c.ddq.name: f"rate[{n}]" for n, c in enumerate(model.plant.moving)}
    table |= {s.direction.name: f"direction[{n}]" for n, s in enumerate(model.surfaces)}
    return table | {name: f"parameters[{n}]" for n, name in enumerate(model.parameters)} | extra


def input_argument(model: Model) -> str:
    """What the integrator's kernels call their input: its own name, or that of a row of several."""
    return model.plant.input.name if len(model.plant.inputs) == 1 else "voltages"


def input_sources(model: Model, argument: str) -> dict[str, str]:
    """Where a kernel finds each input in an argument."""
    inputs = model.plant.inputs
    if len(inputs) == 1:
        return {inputs[0].name: argument}
    return {u.name: f"{argument}[{k}]" for k, u in enumerate(inputs)}


def scalar_sources(model: Model) -> dict[str, str]:
    """The same for a kernel of the integrator, whose arguments are scalars under their own names."""
    plant, surfaces = model.plant, model.surfaces
    accelerations = (c.ddq for c in plant.moving)
    scalars = (*model.states, *model.inner, *accelerations, *(s.direction for s in surfaces))
    return sources(model, **{s.name: s.name for s in scalars}, **input_sources(model, input_argument(model)))


def free_motion(model: Model) -> Kernel:
    """Accelerations without dry friction, and the inverse mass matrix, in closed form."""
    accelerations = [c.ddq for c in model.plant.moving]
    residual = sp.Matrix(model.residual)
    mass = residual.jacobian(accelerations)
    inverse = mass.adjugate() / mass.det()
    at_rest = residual.subs(dict.fromkeys(accelerations, 0))
    size = len(accelerations)
    targets = [Target(a.name, -(inverse * at_rest)[i]) for i, a in enumerate(accelerations)]
    targets += [Target(f"mobility_{i}_{j}", inverse[i, j]) for i in range(size) for j in range(size)]
    return kernel(targets, scalar_sources(model))


def residual_jacobian(model: Model) -> Kernel:
    """Derivatives of the residual, dry friction included, with the accelerations held.

    Those in the states are all there, and where the input lags it is a state, the last. Of those in the parameters the
    zero ones are left out.
    """
    slipping = sp.Matrix(model.residual)
    for surface in model.surfaces:
        slipping += sp.Matrix(surface.slip).applyfunc(sp.nsimplify) * surface.law
    by_state = slipping.jacobian([*model.states, *model.inner, *([model.plant.input] if model.lag else [])])
    by_parameter = slipping.jacobian([symbol(p.name) for p in model.fitted])
    rows, columns = by_state.shape
    targets = [Target(f"by_{i}_{j}", by_state[i, j]) for i in range(rows) for j in range(columns)]
    return kernel(targets + nonzero("by_parameter", by_parameter, "stage"), scalar_sources(model))


def drive_jacobian(model: Model) -> Kernel:
    """Derivatives of the driven input in the parameters; zero entries are left out."""
    slopes = [(n, model.drive.diff(symbol(p.name))) for n, p in enumerate(model.fitted)]
    return kernel([Target(f"by_parameter[{n}]", s) for n, s in slopes if s != 0], scalar_sources(model))


def dry_law(model: Model) -> Kernel:
    """Dry friction on each surface against its direction of slip [V]."""
    return kernel([Target(f"force_{n}", s.law) for n, s in enumerate(model.surfaces)], scalar_sources(model))


def dry_sizes(model: Model) -> tuple[str, ...]:
    """Parameters in which the dry laws are linear; no surface has friction where all of them are zero."""
    laws = [s.law for s in model.surfaces]
    sizes = [p.name for p in model.fitted if any(f.has(symbol(p.name)) for f in laws)]
    sizes = [n for n in sizes if all(f.diff(symbol(n), 2) == 0 for f in laws)]
    rest = [f.subs({symbol(n): 0 for n in sizes}) for f in laws]
    if any(f != 0 for f in rest):
        raise ValueError(f"Dry friction must vanish where its linear parameters {sizes} are zero; it leaves {rest}")
    return tuple(sizes)


def outputs_kernel(model: Model) -> Kernel:
    """What the sensors read."""
    return kernel([Target(f"output[{n}]", r) for n, r in enumerate(model.readings)], sources(model))


def output_jacobian(model: Model) -> Kernel:
    """Derivatives of the readings; zero entries are left out."""
    readings = sp.Matrix(model.readings)
    by_state = readings.jacobian(list(model.states))
    by_parameter = readings.jacobian([symbol(p.name) for p in model.fitted])
    return kernel(nonzero("by_state", by_state) + nonzero("by_parameter", by_parameter), sources(model))


def regressor_kernel(model: Model) -> Kernel:
    """Left side and regressor at given accelerations (paper eqs. 21-23)."""
    regressor = model.regressor
    targets = [Target(f"tau[{n}]", value) for n, value in enumerate(regressor.tau)]
    return kernel(targets + nonzero("phi", regressor.phi), directed(model))


def regressor_parts(model: Model) -> Kernel:
    """The three pieces without accelerations (paper eqs. 25, 26)."""
    regressor = model.regressor
    pieces = {"phi2": regressor.phi2, "phi1": regressor.phi1, "phi0": regressor.phi0}
    return kernel([t for name, piece in pieces.items() for t in nonzero(name, piece)], directed(model))


def directed(model: Model) -> dict[str, str]:
    """Sources for the regressor, in which dry friction has the sign of the slip."""
    slips = {}
    for surface in model.surfaces:
        weights = zip(surface.slip, range(len(model.states) // 2, len(model.states)), strict=False)
        slip = " + ".join(f"{w} * state[{n}]" for w, n in weights if w)
        slips[surface.direction.name] = f"_sign({slip})"
    return sources(model, **slips)


def filtered_signals(model: Model) -> tuple[Signal, ...]:
    """Distinct quantities, up to sign, that the filtered regression needs; the left sides come last."""
    found: list[Signal] = []
    for derivatives, piece in enumerate((model.regressor.phi0, model.regressor.phi1, model.regressor.phi2)):
        for entry in piece:
            if entry and _place(model, found, entry, derivatives) is None:
                found.append(Signal(entry, derivatives, entry.has(*model.plant.inputs) and not model.lag))
    held = model.plant.driven and not model.lag
    return (*found, *(Signal(entry, 0, held) for entry in model.regressor.tau))


def signal_rates(model: Model, signals: tuple[Signal, ...]) -> Kernel:
    """Time derivatives of the signals that are differentiated twice; they are functions of the configuration."""
    targets = []
    for n, s in enumerate(signals):
        if s.derivatives == 2:
            rate = sp.Add(*(s.value.diff(c.q) * c.dq for c in model.plant.coordinates))
            targets.append(Target(f"speed[{n}]", rate))
    return kernel(targets, directed(model))


def unmeasured_rates(model: Model) -> tuple[int, ...]:
    """Indices, among the states, of the rates that no sensor of the plant reads."""
    count = len(model.plant.coordinates)
    read = {c.reading for c in model.plant.channels}
    return tuple(count + n for n, c in enumerate(model.plant.coordinates) if c.dq not in read)


def energy_parts(model: Model) -> Kernel:
    """Energy stored and power taken per parameter, and power supplied: the regressor without accelerations."""
    energy = model.regressor.energy
    targets = nonzero_entries("stored", energy.stored) + nonzero_entries("taken", energy.taken)
    return kernel([*targets, Target("supplied[0]", energy.supplied)], directed(model))


def assemble(model: Model, signals: tuple[Signal, ...]) -> Kernel:
    """Put the filtered signals together to left side and regressor (paper eqs. 39, 40)."""
    regressor = model.regressor
    phi = sp.zeros(*regressor.phi.shape)
    for derivatives, piece in enumerate((regressor.phi0, regressor.phi1, regressor.phi2)):
        for place, entry in enumerate(piece):
            if entry:
                place_of_signal = _place(model, signals, entry, derivatives)
                assert place_of_signal is not None, "filtered_signals leaves none out"
                number, sign = place_of_signal
                phi[place] += sign * symbol(f"signal_{number}")
    first = len(signals) - len(regressor.tau)
    targets = [Target(f"tau[{n}]", symbol(f"signal_{first + n}")) for n in range(len(regressor.tau))]
    table = {f"signal_{n}": f"signal[{n}]" for n in range(len(signals))}
    return kernel(targets + nonzero("phi", phi), table)


def nonzero(array: str, matrix: sp.Matrix, *outer: str) -> list[Target]:
    """Targets for the entries of a matrix that are not always zero; ``outer`` are indices before row and column."""
    rows, columns = matrix.shape
    entries = [(i, j) for i in range(rows) for j in range(columns) if matrix[i, j] != 0]
    return [Target(f"{array}[{', '.join([*outer, str(i), str(j)])}]", matrix[i, j]) for i, j in entries]


def nonzero_entries(array: str, row: sp.Matrix) -> list[Target]:
    """Targets for the entries of a row that are not always zero."""
    return [Target(f"{array}[{i}]", entry) for i, entry in enumerate(row) if entry != 0]


def _place(model: Model, signals, entry: sp.Expr, derivatives: int) -> tuple[int, int] | None:
    """Index and sign of an entry among the signals of the same kind."""
    for number, signal in enumerate(signals):
        if signal.derivatives == derivatives:
            for sign in (1, -1):
                if sp.expand(entry - sign * signal.value) == 0:
                    return number, sign
    return None
