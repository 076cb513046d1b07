"""Numbers as text; nothing else in the reports rounds.

Plain numbers are for the terminal, typeset ones for the page (minus sign, powers of ten), and positional ones for
tables that stand beside those of a paper (no exponent as far as that is readable).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from wheelpend.model.units import PlantUnits

SUPERSCRIPT_DIGITS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
POSITIONAL_RANGE = (1e-4, 1e5)  # magnitudes that are readable without an exponent
MIN_TYPESET_P_VALUE = 1e-12  # below it only the bound is written
TIME_UNITS = (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9))
LOST_FIT = -1e6  # %, below which a prediction did not miss but ran away
ROUNDED_UP = 0.9995  # of a unit: to three digits it is the whole unit


def is_number(value: float | None) -> bool:
    """True unless a value is None, NaN or infinite."""
    return value is not None and bool(np.isfinite(value))


# ---- one number


def digits_text(value: float, digits: int = 4) -> str:
    """A number in significant digits; infinity and NaN by their names."""
    return f"{value:.{digits}g}"


def number_text(value: float | None, digits: int = 4) -> str:
    """A number in significant digits, or a dash where there is none."""
    return digits_text(value, digits) if value is not None and is_number(value) else "-"


def prediction_error_text(error: float | None, digits: int = 4) -> str:
    """A prediction error in significant digits, or that the prediction diverged where there is none."""
    return digits_text(error, digits) if error is not None and is_number(error) else "diverged"


def unexplained_input_text(percent: float, driven: bool = True) -> str:
    """What equations leave of the input, in percent, in words from where they leave more than there was.

    Of a machine that nothing drives it is a share of the pull of gravity.
    """
    if percent <= 100.0:
        return f"leave {digits_text(percent, 3)} % of the {'input' if driven else 'pull of gravity'} unexplained."
    times, there = whole_digits_text(percent / 100.0, 2), "was put in" if driven else "gravity pulls with"
    return f"leave {times} times as much force as {there}: with these values they do not describe this log."


def typeset_number_text(value: float | None, digits: int = 4) -> str:
    """A number in significant digits for the page: whole below 10⁶, else with a power of ten."""
    if value is None or not is_number(value):
        return "–"
    if abs(value) >= 10**digits and abs(value) < 1e6:
        return typeset_minus(f"{value:.0f}")
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    return typeset_minus(mantissa) + (f"×{power_of_ten_text(power)}" if power else "")


def positional_number_text(value: float | None, digits: int = 2) -> str:
    """A number in significant digits without an exponent, as far as that is readable."""
    if value is None or not is_number(value):
        return "–"
    if value == 0.0 or POSITIONAL_RANGE[0] <= abs(value) < POSITIONAL_RANGE[1]:
        return typeset_minus(np.format_float_positional(value, digits, fractional=False, trim="-"))
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    return f"{typeset_minus(mantissa)}·{power_of_ten_text(power)}"


def whole_digits_text(value: float, digits: int = 3) -> str:
    """A number in significant digits, or with all digits before the point where these are more."""
    return f"{value:.0f}" if value >= 10 ** (digits - 1) else f"{value:.{digits}g}"


def fixed_number_text(value: float, decimals: int, absent: str) -> str:
    """A number with a fixed count of decimals, or ``absent`` where there is none."""
    return f"{value:.{decimals}f}" if is_number(value) else absent


def error_text(value: float | None, digits: int = 4) -> str:
    """An error of the page with all its significant digits, so that 1.00 is not 1."""
    if value is None or not is_number(value) or abs(value) >= 10**digits:
        return typeset_number_text(value, digits)
    return f"{value:#.{digits}g}".rstrip(".")


def typeset_minus(text: str) -> str:
    """A number with the minus sign that is printed."""
    return text.replace("-", "−")


def power_of_ten_text(power: str) -> str:
    """A power of ten with its exponent raised, from the digits behind an ``e``."""
    return f"10{str(int(power)).translate(SUPERSCRIPT_DIGITS)}"


# ---- a number with its standard error or range


def estimate_text(value: float, sigma: float | None, unit: str) -> str:
    """A value with its standard error, where there is one, and its unit."""
    spread = f" ± {digits_text(sigma, 2)}" if sigma is not None and is_number(sigma) else ""
    return f"{digits_text(value, 5)}{spread} {unit if unit != '1' else ''}".rstrip()


def typeset_estimate_text(value: float | None, sigma: float | None) -> str:
    """Value ± standard error for the page, both to the second significant digit of the latter."""
    if value is None or sigma is None or not is_number(sigma) or sigma <= 0 or not is_number(value):
        return typeset_number_text(value)
    decimals = int(np.clip(1 - np.floor(np.log10(sigma)), 0, 9))
    if decimals == 9 or abs(value) >= 1e5:
        return f"{typeset_number_text(value)} ± {typeset_number_text(sigma, 2)}"
    return typeset_minus(f"{value:.{decimals}f} ± {sigma:.{decimals}f}")


def small_estimate_text(value: float, sigma: float) -> str:
    """Value ± standard error for the page; values below 10⁻³ in powers of ten."""
    if abs(value) >= 1e-3:
        return typeset_estimate_text(value, sigma)
    return f"{typeset_number_text(value, 5)} ± {typeset_number_text(sigma, 2)}"


def range_text(low: float, high: float, digits: int = 2) -> str:
    """A range in positional numbers; one number where both ends read the same."""
    first, last = positional_number_text(low, digits), positional_number_text(high, digits)
    return first if first == last else f"{first} to {last}"


# ---- probabilities and shares


def p_value_text(p: float) -> str:
    """A p-value in two significant digits."""
    return f"{p:.1e}"


def typeset_p_value_text(p: float | None) -> str:
    """A p-value in one significant digit for the page; very small ones only as a bound."""
    if p is None:
        return "–"
    return "< 10⁻¹²" if p < MIN_TYPESET_P_VALUE else typeset_number_text(p, 1)


def correlation_text(value: float) -> str:
    """A correlation to two decimals for the page."""
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "−")  # no minus before zero


def percent_text(share: float, decimals: int = 0) -> str:
    """A share in percent."""
    return f"{100 * share:.{decimals}f} %"


def fit_text(percent: float | None) -> str:
    """A fit [%] of a channel; nothing where it is not known."""
    if percent is None:
        return ""
    return f"{percent:.2f}" if percent > LOST_FIT else "diverged"


def share_text(share: float) -> str:
    """A share in percent: two digits of a small one, whole percent from 10 % on."""
    return f"{whole_digits_text(100.0 * share, 2) if share >= 0.1 else digits_text(100.0 * share, 2)} %"


def incomplete_percent_text(share: float) -> str:
    """A share in whole percent, and 100 % only where it is all."""
    return f"{min(round(100 * share), 99) if share < 0.9995 else 100} %"


def percent_range_text(interval: tuple[float, float], dash: str = "-") -> str:
    """A range of shares in whole percent, without the percent sign."""
    low, high = interval
    return f"{100 * low:.0f}{dash}{100 * high:.0f}"


# ---- numbers with units


def unit_text(unit: str) -> str:
    """A unit for the page; nothing for a plain number."""
    return "" if unit == "1" else unit.replace(" ", "·")


def quantity_text(value: float | None, unit: str, digits: int = 4) -> str:
    """A number with its unit on the terminal; a plain number has none, and so has no number."""
    text = number_text(value, digits)
    return text if unit in ("", "1") or not is_number(value) else f"{text} {unit}"


def physical_text(value: float, unit: str, quantities: PlantUnits, digits: int) -> str:
    """A generalised force in N m, or N; nothing where it is no force or the worth of a volt is not known."""
    found = quantities.in_physical(value, unit)
    return f"{digits_text(found[0], digits)} {found[1]}" if found else ""


def typeset_physical_text(value: float, unit: str, quantities: PlantUnits) -> str:
    """The same for the page."""
    found = quantities.in_physical(value, unit)
    return f"{typeset_number_text(found[0], 3)} {unit_text(found[1])}" if found else ""


def time_text(seconds: float, piece: str = "") -> str:
    """A time to three digits, in the unit that suits it, of one ``piece`` of work."""
    unit, size = next((u for u in TIME_UNITS if seconds >= ROUNDED_UP * u[1]), TIME_UNITS[-1])
    return f"{whole_digits_text(seconds / size)} {unit}{'/' if piece else ''}{piece}"
