"""Inspection of a log: clock, gaps, ranges, noise, standstill, and faults of its wiring."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wheelpend.estimation.data import noise_of
from wheelpend.inspection.counters import find_copies
from wheelpend.inspection.equations import least_samples
from wheelpend.inspection.findings import Finding, LogCorrections, with_consistent_signs, with_settings
from wheelpend.inspection.late_command import find_late_command
from wheelpend.inspection.noisy_input import find_noisy_inputs
from wheelpend.inspection.raw_units import find_counts, find_duty, find_rectified, in_counts
from wheelpend.inspection.sampling import find_sampling_faults
from wheelpend.inspection.signals import MIN_ANALYSED_S, MIN_ANALYSED_SAMPLES, channel_values, uniform_signals
from wheelpend.inspection.standstill import (
    constant_signal_times,
    find_gaps,
    find_no_excitation,
    find_silent_channels,
    standstills,
)
from wheelpend.inspection.wiring import find_faults
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.kernels.load import model_module
from wheelpend.logs.columns import DEFAULT_TABLE, ColumnMap, ColumnTable
from wheelpend.logs.guess import guess_column_maps
from wheelpend.logs.log import REST_SHARE, Log
from wheelpend.logs.noise import Noise, find_quantum, sensor_noise
from wheelpend.logs.outliers import Outliers, outlier_sentences, outliers_of, without_outliers
from wheelpend.logs.read import load_log
from wheelpend.logs.recording import cured
from wheelpend.model.record import Model

MAX_QUANTUM_SAMPLES = 40_000  # samples from which the input's step is found


@dataclass(frozen=True)
class Inspection:
    """Statistics of a log, its findings, and the lines of a model.toml that follow from them."""

    samples: int
    duration_s: float
    rate_hz: float  # 1 / median interval
    jitter: float  # standard deviation of the intervals over their median, gaps left out
    gaps: dict[str, float]  # count, longest [s]
    channels: dict[str, dict[str, float]]  # minimum, maximum, noise, quantum [unit of the channel], missing [share]
    findings: tuple[Finding, ...]
    proposal: str  # lines for model.toml that would cure the findings; empty when there is nothing to propose
    sensors: str = ""  # lines for model.toml that say what the sensors are like, by this log
    stand_still: dict[str, list[tuple[float, float]]] = field(default_factory=dict)  # from, to [s] by channel
    untested: Mapping[str, int] = field(default_factory=dict)  # signs or clocks that nothing is said on: samples needed

    @property
    def least_duration_s(self) -> float:
        """Duration [s] of a stretch from which on signs and clocks are tested, however many samples it has."""
        return MIN_ANALYSED_S

    def to_json(self) -> dict[str, Any]:
        """The result under the keys of JSON."""
        return {
            "samples": self.samples,
            "duration_s": self.duration_s,
            "rate_hz": self.rate_hz,
            "jitter": self.jitter,
            "gaps": self.gaps,
            "channels": self.channels,
            "findings": self.findings,
            "proposal": self.proposal,
            "sensors": self.sensors,
            "stand_still": self.stand_still,
        }


def inspect_log(
    log: Log,
    *,
    relative: bool = False,
    noise: Noise | None = None,
    columns: Mapping[str, ColumnMap] | None = None,
    guessed: Collection[str] = (),
    table: ColumnTable = DEFAULT_TABLE,
    module: KernelModule | None = None,
    second_encoder: str = "",
) -> Inspection:
    """Inspect a log before a model is fitted to it.

    ``relative`` says that theta_w is measured against the body; ``columns`` are those with which the log was read, for
    the proposal, ``guessed`` those of them that nobody stated, ``table`` the plant's. Nothing is concluded on signs,
    units and clocks from a log that moves too little. ``module`` are the kernels of the bare plant, for what only the
    equations of motion show; ``second_encoder`` is what the angle of a second link is measured against by them.
    """
    log = cured(log, table)
    outliers = outliers_of(log, table)
    raw, log = log, without_outliers(log, outliers)
    noise = noise or sensor_noise(log, {}, {})
    interval = np.diff(log.t)
    gaps = interval[interval > log.longest_interval]
    corrections = LogCorrections(columns or {}, table, guessed)
    findings = [
        *log.faults,
        *find_gaps(log),
        *find_sampling_faults(log, table),
        *outlier_findings(outliers),
        *filter_findings(noise),
        *find_copies(log, table),
        *find_duty(log, corrections),
        *find_rectified(log, table),
        *find_no_excitation(log, table),
    ]
    silent = find_silent_channels(log, table)
    still = constant_signal_times(log, noise, table)
    told = {f.channel for f in silent}
    findings += [*silent, *standstill_findings(log, {c: t for c, t in still.items() if c not in told}, table)]
    if set(table.channels) <= set(log.channels):
        findings += find_faults(log, relative, corrections, module, second_encoder)
    if not corrections.source:  # of interchanged columns none
        findings += find_noisy_inputs(log, corrections)
        findings += find_late_command(log, corrections)
    unit_told = {f.channel for f in findings if f.kind in ("counts", "wrong_unit")}
    findings += [f for f in find_counts(log, corrections) if f.channel not in unit_told]
    findings = with_consistent_signs(findings, corrections)
    return Inspection(
        samples=len(log),
        duration_s=log.duration,
        rate_hz=1.0 / log.dt,
        jitter=float(np.std(interval[interval <= log.longest_interval]) / log.dt),
        gaps={"count": len(gaps), "longest": float(gaps.max(initial=0.0))},
        channels=channel_statistics(raw, noise, table),
        findings=with_settings(findings, corrections),
        proposal=corrections.text(),
        sensors=sensors_section_text(log, noise, table, corrections),
        stand_still=standstills(log, noise, table),
        untested=untested_faults(log, table, module),
    )


def untested_faults(log: Log, table: ColumnTable, module: KernelModule | None) -> dict[str, int]:
    """What nothing can be concluded on, signs or clocks, with the samples without a gap that it takes."""
    needed = {"signs": least_samples(module), "clocks": MIN_ANALYSED_SAMPLES}
    return {w: n for w, n in needed.items() if uniform_signals(log, table.input, in_range=False, least=n) is None}


def inspect_for_model(model: Model, log: Log, guessed: Mapping[str, ColumnMap] | None = None) -> Inspection:
    """Inspect a log of a model's plant and sensors; ``guessed`` are columns that the model does not map.

    What an effect of the model accounts for is no finding.
    """
    found = inspect_log(
        log,
        relative=model.assumptions.get("encoder") == "relative",
        noise=noise_of(without_outliers(log, outliers_of(log, model.table)), model),
        columns={**model.columns, **(guessed or {})},
        guessed=tuple(guessed or ()),
        table=model.table,
        module=bare_module(model),
        second_encoder=model.assumptions.get("second_encoder", "") if model.assumptions.get("links") == 2 else "",
    )
    return replace(found, findings=tuple(f for f in found.findings if f.effect not in model.effects))


def bare_module(model: Model) -> KernelModule | None:
    """Kernels of a model's plant without effects; None where the plant brings a check of its own, which needs none."""
    return None if model.table.wiring_check else model_module(model.plant, model.assumptions, ())


def inspect_file(model: Model, path: Path) -> tuple[Log, Inspection]:
    """Read and inspect a log; columns that the model does not map are guessed where possible."""
    guessed = guess_column_maps(path, model.columns, model.table)
    log = load_log(path, {**model.columns, **guessed}, model.table)
    return log, inspect_for_model(model, log, guessed)


def channel_statistics(log: Log, noise: Noise, table: ColumnTable) -> dict[str, dict[str, float]]:
    """Range, noise, step and share of missing samples of the input and of every channel."""
    inputs = zip(table.inputs, log.inputs, strict=False)
    rows = [(name, values, 0.0, find_quantum(values[:MAX_QUANTUM_SAMPLES])) for name, values in inputs]
    rows += [(c, log.measured[:, k], noise.sigma[k], noise.quantum[k]) for k, c in enumerate(log.channels)]
    return {
        name: {
            "minimum": float(np.nanmin(values)),
            "maximum": float(np.nanmax(values)),
            "noise": float(sigma),
            "quantum": float(step),
            "missing": float(np.isnan(values).mean()),
        }
        for name, values, sigma, step in rows
    }


def sensors_section_text(log: Log, noise: Noise, table: ColumnTable, corrections: LogCorrections) -> str:
    """Section [sensors] of a model.toml with what the log says of its sensors: noise, or steps.

    The step of interchanged columns belongs to what its column holds; that of one still in counts is no angle's.
    """
    holds = {column: name for name, column in corrections.source.items()}
    levels: dict[str, float] = {}
    steps: dict[str, float] = {}
    for name, sigma, step in zip(log.channels, noise.sigma, noise.quantum, strict=True):
        if in_counts(name, channel_values(log, name), corrections.known.get(name, ColumnMap(name)), table):
            continue
        if holds.get(name, name) in table.channels:
            (steps if step else levels)[holds.get(name, name)] = float(step or sigma)
    own = []
    counts, noise_keys = ({c: getattr(s, k) for c, s in table.sensors.items()} for k in ("counts_key", "noise_key"))
    own += [f"{counts[c]} = {round(2 * math.pi / steps.pop(c))}" for c in [*steps] if counts.get(c)]
    own += [f"{noise_keys[c]} = {levels.pop(c):.3g}" for c in [*levels] if noise_keys.get(c)]
    lines = ["[sensors]", *own] if own else []
    for title, found in (("noise", levels), ("step", steps)):
        if found:
            lines += [""] * bool(lines) + [f"[sensors.{title}]", *(f"{c} = {v:.4g}" for c, v in found.items())]
    return "".join(f"{line}\n" for line in lines)


def outlier_findings(found: Outliers) -> list[Finding]:
    """A finding on each channel with readings that no motion explains: spikes, and jumps that stay."""
    cures = {
        "spikes": "Nothing to do: they count as missing. Look for a loose cable or interference if they are many.",
        "jump": "Nothing to do: no segment reaches across. Check the encoder: it lost counts, or slipped on its shaft.",
    }
    rows = []
    for kind, own in (("spikes", found.spikes), ("jump", found.jumps)):
        for channel in dict.fromkeys(o.channel for o in own):
            mine = tuple(o for o in own if o.channel == channel)
            alone = Outliers(mine, ()) if kind == "spikes" else Outliers((), mine)
            size = max((o.size for o in mine), key=abs)
            rows.append(Finding(kind, channel, outlier_sentences(alone)[0], cures[kind], size))
    return rows


def filter_findings(noise: Noise) -> list[Finding]:
    """A finding on each channel that was filtered, fused or computed before it was logged."""
    return [Finding("filtered", remark.split()[0], remark, "", None) for remark in noise.remarks]


def rests_without_command(log: Log, name: str, times: Sequence[tuple[float, float]]) -> bool:
    """True of a machine with a motor that does nothing in some times [s], in which no other channel than one moves."""
    if not np.any(log.inputs[np.isfinite(log.inputs)]):
        return False
    others = [channel_values(log, c) for c in log.channels if c != name]
    within = [(log.t >= begin) & (log.t < end) for begin, end in times]
    return not any(
        np.any(log.inputs[:, now]) or any(_range_of(v[now]) > REST_SHARE * _range_of(v) for v in others)
        for now in within
    )


def _range_of(values: np.ndarray) -> float:
    """The range of the known ones of values (N,); 0 without any."""
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if known.size else 0.0


def standstill_findings(log: Log, still: Mapping[str, list[tuple[float, float]]], table: ColumnTable) -> list[Finding]:
    """A finding on each channel that is constant at times, with the total and the longest time."""
    found = []
    for name, times in still.items():
        total, (begin, end) = sum(b - a for a, b in times), max(times, key=lambda pair: pair[1] - pair[0])
        known = table.sensors[name].still if name in table.sensors else ""
        event = known or f"{name} repeats one value"
        sentence = f"{event} for {total:.3g} s in all, the longest time {end - begin:.3g} s from t = {begin:.6g} s."
        cure = "Little can be learnt from such stretches; if the machine did move, check this sensor."
        if rests_without_command(log, name, times):
            cure = "Nothing is commanded then, and little can be learnt from such stretches."
        found.append(Finding("stand_still", name, sentence, cure, total))
    return found
