"""Values that somebody who wishes harm, or a broken logger, would put into a cell, a name or an option."""

from hypothesis import strategies as st

CELLS = (
    "", " ", "nan", "NaN", "inf", "-inf", "1e308", "-1e308", "1e400", "1e-320", "-0", "0", "1", "abc", "0x10", "1,5",
    "1_000", " 1 ", "١", "true", "2026-01-01T00:00:00", "12:00:00", '"', '""', "'", "=1+1", "1;2", "#", "\x00", "\x1b[2J",
    "None", "--", "9" * 400, "1e", "+", ".", "∞", "½", "−1",
)  # fmt: skip
NAMES = (
    "", " ", "t", "T", "time", "v_in", "theta_w", "theta_p", "dtheta_p", "theta_ref", "theta_p ", "\ufefft", "t\x00", "unnamed",
    "<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "</script>", "[bold]x[/bold]", "[/]", "\x1b[31mred", "a" * 3000,
    "\u202egpj.csv", "{{ 7*7 }}", "%s%n", "__class__", "import os", "$(touch ran)", "a,b", "'", "\\", "0", "1e9", "π", "t [s]",
    "nan", "#t", "X1", "slope", "\u2028", "\x7f", "\ud7ff",
)  # fmt: skip
NUMBERS = (
    "0", "-0.0", "1", "-1", "1e-320", "1e308", "-1e308", "inf", "-inf", "nan", "1e400", "99999999999999999999999", "0.5", "1e-9",
    "9223372036854775807", "9223372036854775808", "0x7f", "1_0",
)  # fmt: skip

cells = st.sampled_from(CELLS)
names = st.sampled_from(NAMES) | st.text(max_size=8)
numbers = st.sampled_from(NUMBERS)


def steps(*makers):
    """A few changes after one another, each a function of what came before."""
    return st.lists(st.one_of(*makers), min_size=1, max_size=3)


def apply_all(changes, value):
    """What becomes of a value."""
    for change in changes:
        value = change(value)
    return value
