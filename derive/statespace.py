"""State-space pieces of a model: free motion, its Jacobians, dry friction, sensors, regressor."""

from __future__ import annotations

import math
from typing import NamedTuple

import sympy as sp

from derive.algebra import adjugate_of, expand, holding, jacobian, replaced, slope, symbols_in
from derive.functions import TIME, symbol
from derive.model import named, slip_row
from derive.printing import Kernel, Target, kernel
from derive.records import Memory, Model, Relations
from derive.regressor import dry_forces


class Signal(NamedTuple):
    """A quantity to be filtered for the regression, and how often it is differentiated."""

    value: sp.Expr
    derivatives: int  # 0, 1 or 2
    held: bool  # whether it is constant between samples, as the input is


class Filtered(NamedTuple):
    """The filtered regression: signals, and the features that its rows are made of.

    A feature is a sum of filtered signals that always come together; ``rows`` hold, for each row of the regression, the
    weights of the features in each column of φ and then in τ.
    """

    signals: tuple[Signal, ...]
    features: tuple[tuple[tuple[float, int], ...], ...]  # weight and signal
    rows: tuple[tuple[tuple[float, ...], ...], ...]  # (NQ, parameters + 1, features)


class MemoryCode(NamedTuple):
    """A force with a memory: its name, its index among the variables, and its path by the moving coordinates."""

    name: str
    place: int
    path: tuple[tuple[float, str, int], ...]  # weight, coordinate, its index among the variables
    value: Kernel
    jacobian: Kernel


class Code(NamedTuple):
    """Everything the templates need; strings and numbers only."""

    simple: bool  # whether a step has neither events nor memory, so that many machines can take it side by side
    turns: tuple[str, ...]  # names of the angles whose sines and cosines the equations of motion take

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
    filters: tuple[tuple[int, ...], ...]  # signals that are read from each: they differ in their derivatives alone
    features: tuple[tuple[tuple[float, int], ...], ...]  # weight and signal
    mixing: tuple[tuple[tuple[float, ...], ...], ...]  # weights of the features in [φ τ]
    unmeasured: tuple[int, ...]  # indices of the rates that no sensor reads
    kernels: dict[str, Kernel]


def generate_code(model: Model) -> Code:
    """Turn a model into the text of its kernels."""
    filtered = filtered_regression(model)
    outputs = tuple(c.name for c in model.plant.channels)
    names = model.parameters
    variables = variables_of(model)
    return Code(
        simple=simple(model),
        turns=tuple(turns_of(model).values()),
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
        signals=tuple((s.derivatives, s.held) for s in filtered.signals),
        filters=shared_filters(filtered.signals),
        features=filtered.features,
        mixing=filtered.rows,
        unmeasured=unmeasured_rates(model),
        kernels={
            "angles": angles(model),
            "controlled": controlled_kernel(model),
            "free_motion": free_motion(model),
            "residual_jacobian": residual_jacobian(model),
            "dry_law": dry_law(model),
            "drive": kernel([Target("driven", model.drive)], scalar_sources(model)),
            "drive_jacobian": drive_jacobian(model),
            "outputs": outputs_kernel(model),
            "readings": kernel(
                [Target(f"reading_{n}", r) for n, r in enumerate(model.readings)], scalar_sources(model)
            ),
            "output_jacobian": output_jacobian(model),
            "regressor": regressor_kernel(model),
            "regressor_parts": regressor_parts(model),
            "energy_parts": energy_parts(model),
            "signal_rates": signal_rates(model, filtered.signals),
            "signals": signals_kernel(model, filtered.signals),
            **assembling(filtered),
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
    weights = jacobian(readings, model.states)
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
    slopes = [Target("by_before", slope(memory.law, memory.before)), Target("by_path", slope(memory.law, memory.path))]
    own = [(n, slope(memory.law, symbol(p.name))) for n, p in enumerate(model.fitted)]
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
        others = {s: sp.Integer(0) for e in model.effects for p, s in zip(e.parameters, e.symbols.values(), strict=True)
                  if p.absent == 0.0 and s not in own}  # fmt: skip
        inner = model.plant.inner.get(effect.frees)
        touched = (*own, *((inner.q, inner.dq, inner.ddq) if inner else ()))
        parts = [replaced(holding(row, touched), others) for row in model.residual]
        inside = set().union(*(symbols_in(slope(part, s)) for part in parts for s in touched))
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


def turns_of(model: Model) -> dict[sp.Expr, str]:
    """What the equations of motion take sines and cosines of and that changes with time: expression → name."""
    varying = {TIME, *model.states, *model.inner}
    found = {f.args[0] for row in model.residual for f in row.atoms(sp.sin, sp.cos)}
    ordered = sorted((a for a in found if a.free_symbols & varying), key=sp.default_sort_key)
    return {a: a.name if a.is_Symbol else f"sum_{n}" for n, a in enumerate(ordered)}


def angles(model: Model) -> Kernel:
    """Those expressions."""
    return kernel([Target(f"angle_{name}", a) for a, name in turns_of(model).items()], scalar_sources(model))


def simple(model: Model) -> bool:
    """Whether a step has neither events nor memory, of one input and a controller that reads angle and rate."""
    remembers = model.surfaces or model.memories or model.moments or model.lag or model.delay or model.sensor_delay
    inner = len(model.plant.moving) > len(model.plant.coordinates)
    return (
        not (remembers or inner) and model.plant.driven and len(model.plant.inputs) == 1 and all(model.plant.controlled)
    )


def controlled_kernel(model: Model) -> Kernel:
    """What the controller sees, in the states; nothing where it reads no rate."""
    outputs = [c.name for c in model.plant.channels]
    seen = zip(("angle", "rate"), model.plant.controlled, strict=True)
    return kernel([Target(n, model.readings[outputs.index(c)]) for n, c in seen if c], scalar_sources(model))


def turned(model: Model, targets: list[Target]) -> list[Target]:
    """Targets whose sines and cosines of these are arguments of the kernel."""
    turns = turns_of(model).items()
    known = {f(a): symbol(f"{f.__name__}_{name}") for a, name in turns for f in (sp.sin, sp.cos)}
    return [Target(t.place, sp.sympify(t.value).xreplace(known)) for t in targets]


def turn_sources(model: Model) -> dict[str, str]:
    """Sources for a kernel that is handed sines and cosines."""
    names = [f"{f}_{name}" for name in turns_of(model).values() for f in ("sin", "cos")]
    return {**scalar_sources(model), **{name: name for name in names}}


def free_motion(model: Model) -> Kernel:
    """Accelerations without dry friction, and the inverse mass matrix, in closed form.

    The forces are multiplied by the adjugate while the determinant is being divided by, which comes last: one stage of
    a step waits for the other, and so for the longest chain of operations, not for their number.
    """
    accelerations = [c.ddq for c in model.plant.moving]
    mass = jacobian(model.residual, accelerations)
    adjugate, determinant = adjugate_of(mass)
    at_rest = [replaced(row, dict.fromkeys(accelerations, sp.Integer(0))) for row in model.residual]
    size = len(accelerations)
    forces = [sp.Add(*(adjugate[i, k] * at_rest[k] for k in range(size))) for i in range(size)]
    targets = [Target(a.name, -force / determinant) for a, force in zip(accelerations, forces, strict=True)]
    targets += [Target(f"mobility_{i}_{j}", adjugate[i, j] / determinant) for i in range(size) for j in range(size)]
    return kernel(turned(model, targets), turn_sources(model))


def residual_jacobian(model: Model) -> Kernel:
    """Derivatives of the residual, dry friction included, with the accelerations held.

    Those in the states are all there, and where the input lags it is a state, the last. Of those in the parameters the
    zero ones are left out.
    """
    dry = dry_forces(model.surfaces, len(model.residual))
    slipping = [row + force for row, force in zip(model.residual, dry, strict=True)]
    by_state = jacobian(slipping, [*model.states, *model.inner, *([model.plant.input] if model.lag else [])])
    by_parameter = jacobian(slipping, [symbol(p.name) for p in model.fitted])
    rows, columns = by_state.shape
    targets = [Target(f"by_{i}_{j}", by_state[i, j]) for i in range(rows) for j in range(columns)]
    targets += nonzero("by_parameter", by_parameter, "stage")
    return kernel(turned(model, targets), turn_sources(model))


def drive_jacobian(model: Model) -> Kernel:
    """Derivatives of the driven input in the parameters; zero entries are left out."""
    slopes = [(n, slope(model.drive, symbol(p.name))) for n, p in enumerate(model.fitted)]
    return kernel([Target(f"by_parameter[{n}]", s) for n, s in slopes if s != 0], scalar_sources(model))


def dry_law(model: Model) -> Kernel:
    """Dry friction on each surface against its direction of slip [V]."""
    return kernel([Target(f"force_{n}", s.law) for n, s in enumerate(model.surfaces)], scalar_sources(model))


def dry_sizes(model: Model) -> tuple[str, ...]:
    """Parameters in which the dry laws are linear; no surface has friction where all of them are zero.

    What only scales another one, as a plant's own parameter does in a friction that grows with the load, is left out.
    """
    laws = [s.law for s in model.surfaces]
    sizes = [p.name for p in model.fitted if any(symbol(p.name) in symbols_in(f) for f in laws)]
    sizes = [n for n in sizes if all(slope(slope(f, symbol(n)), symbol(n)) == 0 for f in laws)]

    for name in sorted(sizes, key=lambda n: "." in n):  # the plant's own ones first
        others = [n for n in sizes if n != name]
        sizes = sizes if any(f != 0 for f in _without(laws, others)) else others
    rest = _without(laws, sizes)
    if any(f != 0 for f in rest):
        raise ValueError(f"Dry friction must vanish where its linear parameters {sizes} are zero; it leaves {rest}")
    return tuple(sizes)


def _without(laws: list[sp.Expr], names: list[str]) -> list[sp.Expr]:
    return [f.subs({symbol(n): 0 for n in names}) for f in laws]


def outputs_kernel(model: Model) -> Kernel:
    """What the sensors read."""
    return kernel([Target(f"output[{n}]", r) for n, r in enumerate(model.readings)], sources(model))


def readings_kernel(model: Model) -> Kernel:
    """The same as scalars."""
    return kernel([Target(f"reading_{n}", r) for n, r in enumerate(model.readings)], scalar_sources(model))


def output_jacobian(model: Model) -> Kernel:
    """Derivatives of the readings; zero entries are left out."""
    readings = sp.Matrix(model.readings)
    by_state = jacobian(readings, model.states)
    by_parameter = jacobian(readings, [symbol(p.name) for p in model.fitted])
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


def filtered_regression(model: Model) -> Filtered:
    """What the regression has to filter: each distinct term of its entries once, whatever its factor."""
    regressor, count = model.regressor, len(model.regressor.parameters)
    entries: dict[tuple[sp.Expr, int], dict[tuple[int, int], float]] = {}  # term and derivatives → weight in each entry
    pieces = enumerate((regressor.phi0, regressor.phi1, regressor.phi2))
    for derivatives, matrix in [*pieces, (0, regressor.tau)]:
        for place, entry in enumerate(matrix):
            row, column = divmod(place, count) if matrix is not regressor.tau else (place, count)
            for term in sp.Add.make_args(expand(entry)):
                weight, value = term.as_coeff_Mul()
                if weight:
                    shares = entries.setdefault((value, derivatives), {})
                    shares[row, column] = shares.get((row, column), 0.0) + float(weight)
    together: dict[tuple, list[tuple[float, int]]] = {}  # entries that a feature is in → its signals
    signals: list[Signal] = []
    for (value, derivatives), shares in entries.items():
        scale = next(iter(shares.values()))
        pattern = tuple(sorted((place, weight / scale) for place, weight in shares.items()))
        together.setdefault(pattern, []).append((scale, len(signals)))
        signals.append(Signal(value, derivatives, value.has(*model.plant.inputs) and not model.lag))
    rows = [[[0.0] * len(together) for _ in range(count + 1)] for _ in range(regressor.tau.rows)]
    for feature, pattern in enumerate(together):
        for (row, column), weight in pattern:
            rows[row][column][feature] = weight
    return Filtered(tuple(signals), tuple(map(tuple, together.values())), tuple(tuple(map(tuple, row)) for row in rows))


def shared_filters(signals: tuple[Signal, ...]) -> tuple[tuple[int, ...], ...]:
    """Signals that enter the filters as the same quantity, however often they are differentiated after it."""
    together: dict[tuple[sp.Expr, bool], list[int]] = {}
    for n, s in enumerate(signals):
        together.setdefault((s.value, s.held), []).append(n)
    return tuple(map(tuple, together.values()))


def assembling(filtered: Filtered) -> dict[str, Kernel]:
    """The features from the filtered signals, and left side and regressor from the features (paper eqs. 39, 40)."""
    signals, features = (
        [symbol(f"{kind}_{n}") for n in range(len(of))]
        for kind, of in (("signal", filtered.signals), ("feature", filtered.features))
    )
    sums = [sp.Add(*(number(w) * signals[n] for w, n in feature)) for feature in filtered.features]
    rows = sp.Matrix([[sp.Add(*(number(w) * f for w, f in zip(weights, features, strict=True))) for weights in row]
                      for row in filtered.rows])  # fmt: skip
    names = {s.name: s.name for s in (*signals, *features)}
    left = [Target(f"tau[{n}]", v) for n, v in enumerate(rows[:, -1])]
    return {
        "features": kernel([Target(f.name, value) for f, value in zip(features, sums, strict=True)], names),
        "assemble": kernel(left + nonzero("phi", rows[:, :-1]), names),
    }


def number(value: float) -> sp.Expr:
    """A weight as it is printed: 1, not 1.0."""
    return sp.Integer(int(value)) if value == int(value) else sp.Float(value)


def signals_kernel(model: Model, signals: tuple[Signal, ...]) -> Kernel:
    """The quantities that are filtered, in the states and the angles' sines and cosines."""
    weights = {s.direction.name: s.slip for s in model.surfaces}
    rates = [s.name for s in model.states[len(model.states) // 2 :]]
    slips = {
        name: f"_sign({' + '.join(f'{w} * {r}' for w, r in zip(slip, rates, strict=False) if w)})"
        for name, slip in weights.items()
    }
    targets = [Target(f"signal_{n}", s.value) for n, s in enumerate(signals)]
    return kernel(turned(model, targets), {**turn_sources(model), **slips})


def signal_rates(model: Model, signals: tuple[Signal, ...]) -> Kernel:
    """Time derivatives of the signals that are differentiated twice; they are functions of the configuration."""
    targets = []
    for n, s in enumerate(signals):
        if s.derivatives == 2:
            rate = sp.Add(*(slope(s.value, c.q) * c.dq for c in model.plant.coordinates))
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


def nonzero(array: str, matrix: sp.Matrix, *outer: str) -> list[Target]:
    """Targets for the entries of a matrix that are not always zero; ``outer`` are indices before row and column."""
    rows, columns = matrix.shape
    entries = [(i, j) for i in range(rows) for j in range(columns) if matrix[i, j] != 0]
    return [Target(f"{array}[{', '.join([*outer, str(i), str(j)])}]", matrix[i, j]) for i, j in entries]


def nonzero_entries(array: str, row: sp.Matrix) -> list[Target]:
    """Targets for the entries of a row that are not always zero."""
    return [Target(f"{array}[{i}]", entry) for i, entry in enumerate(row) if entry != 0]
