"""Faults of wiring, units, signs and clocks: by the check that a plant brings along, else by those for any machine."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from wheelpend.inspection import wheels_and_body
from wheelpend.inspection.clocks import rate_shift_findings
from wheelpend.inspection.equations import find_input_faults, find_second_encoder_fault, is_right_as_it_is
from wheelpend.inspection.findings import Finding, LogCorrections
from wheelpend.inspection.first_motion import backward_start, sets_out_backwards
from wheelpend.inspection.kinematics import RatePair, find_range_in_degrees, find_rate_faults, find_wrapped_angles
from wheelpend.kernels.kernel_module import KernelModule
from wheelpend.logs.log import Log

Check = Callable[[Log, bool, LogCorrections], list[Finding]]
PLANT_CHECKS: dict[str, Check] = {"wheels_and_body": wheels_and_body.find_faults}  # by the name in a plant file


def find_faults(
    log: Log, relative: bool, corrections: LogCorrections, module: KernelModule | None, second_encoder: str = ""
) -> list[Finding]:
    """Faults of wiring, units, signs and clocks; each is cured in a copy before the next is looked for.

    ``relative`` says that an encoder is read against the body; ``module`` are the kernels of the bare plant, without
    which nothing is concluded from the equations of motion; ``second_encoder`` says against what the angle of a second
    link is measured, "relative" or "absolute", where there is one.
    """
    if check := PLANT_CHECKS.get(corrections.table.wiring_check):
        return check(log, relative, corrections)
    table, findings = corrections.table, []
    pairs = [RatePair(angle, rate) for rate, angle in table.rates.items()]
    angles = [c for c in table.channels if table.units[c] == "rad"]
    checks = [partial(find_wrapped_angles, names=angles, corrections=corrections)]
    checks += [partial(find_range_in_degrees, corrections=corrections)] if table.range_channel in log.channels else []
    checks += [partial(find_rate_faults, pair=pair, corrections=corrections) for pair in pairs]
    for run in checks:
        found, log = run(log)
        findings += found
    if corrections.rate_delay_samples and pairs:
        findings += rate_shift_findings(pairs[-1].rate, pairs[-1].angle, corrections.rate_delay_samples, log.dt)
    if module is None:
        return findings
    if second_encoder:
        findings += find_second_encoder_fault(log, module, second_encoder, corrections)
    findings += find_input_faults(log, module, pairs, corrections)
    if module.NQ > 1 or len(table.inputs) != 1 or any(f.kind == "flipped_sign" for f in findings):
        return findings
    place = table.places[0]
    backwards = sets_out_backwards(log, place, hangs=table.pulled)
    if backwards and not is_right_as_it_is(log, module):
        findings.append(backward_start(place, corrections))
    return findings
