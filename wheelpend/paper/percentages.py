"""The percentages of Tables 1 to 3 against the estimates beside them."""

from __future__ import annotations

from collections.abc import Iterator

from wheelpend.paper import numbers
from wheelpend.paper.printed_numbers import Interval, NumberCheck, rounding_half_width


def estimate_columns() -> dict[str, numbers.Column]:
    """Every column of estimates in Tables 1 to 3; Table 2 repeats a column of Table 1."""
    return {
        "Table 1, differentiation": numbers.SIMPLE_DIFFERENTIATION,
        "Tables 1 and 2, filtered, simple command": numbers.SIMPLE_FILTERED,
        "Table 2, aggressive command": numbers.AGGRESSIVE_FILTERED,
        **{f"Table 3, case {case}": column for case, (_, _, column) in numbers.TABLE_3.items()},
    }


def percentage(estimate: float, reference: float) -> Interval:
    """Relative error of an estimate [%], with the rounding of the estimate and of the reference."""
    spread = rounding_half_width(estimate) + rounding_half_width(reference) * abs(estimate / reference)
    return Interval(100 * abs(estimate - reference) / abs(reference), 100 * spread / abs(reference))


def printed_percentage(error: float) -> Interval:
    """A printed percentage, which may have been rounded or truncated."""
    return Interval(error, 2 * rounding_half_width(error))


def check_tables() -> Iterator[NumberCheck]:
    """Check every column of percentages; a percentage that does not follow from its estimate has a check of its own."""
    for title, column in estimate_columns().items():
        rows = list(zip(numbers.REFERENCE_PARAMETERS.items(), column.estimates, column.errors, strict=True))
        wrong = [r for r in rows if not percentage(r[1], r[0][1]).overlaps(printed_percentage(r[2]))]
        count = f"{len(rows) - len(wrong)} of {len(rows)} percentages follow from the estimates beside them"
        yield NumberCheck(title, "match", "", "", count)
        for (name, reference), estimate, error in wrong:
            value = percentage(estimate, reference)
            status, note = classify_wrong_percentage(value, printed_percentage(error))
            note = f"estimate {estimate:g} beside {reference:g}; {note}"
            yield NumberCheck(f"{title}, {name}", status, f"{error:g} %", f"{value.value:.5g} %", note)


def classify_wrong_percentage(correct: Interval, printed: Interval) -> tuple[str, str]:
    """Status and note of a wrong percentage: a misprint if only its decimal point is shifted."""
    for shift in (0.01, 0.1, 10.0, 100.0):
        if Interval(printed.value * shift, printed.half_width * shift).overlaps(correct):
            return "misprint", f"the decimal point is off by a factor {shift:g}"
    return "contradiction", f"the ratio {correct.value / printed.value:.4g} is no slip of the decimal point"
