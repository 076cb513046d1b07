"""Table and picture of the growth, at their place in a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from wheelpend.benchmarks.markdown import replace_between
from wheelpend.benchmarks.speed.growth.curve import ScalingCurve
from wheelpend.files import write_text
from wheelpend.isolation import import_configured

BEGIN_MARK, END_MARK = "<!-- written by wheelpend.benchmarks.speed.growth -->", "<!-- end of growth -->"
PICTURE_FILE_NAME = "performance_growth.svg"
TABLE_HEADER = """\
| work | grows with | sizes | time [s] | its exponent | memory beyond the input [MB] |
|---|---|---|---|---|---|"""
PANEL_ROWS = (("seconds", "time [s]"), ("megabytes", "memory beyond the input [MB]"))


def markdown_table(found: Sequence[ScalingCurve]) -> str:
    """One row per kind of work, with its sizes, times and peaks of memory."""
    lines = [TABLE_HEADER]
    for g in found:
        sizes, seconds, memory = (
            ", ".join(form.format(x) for x in column)
            for form, column in zip(("{:,}", "{:.3g}", "{:.0f}"), zip(*g.found, strict=True), strict=True)
        )
        lines.append(f"| `{g.name}` | {g.over} | {sizes} | {seconds} | {g.exponent('seconds'):.2f} | {memory} |")
    return "\n".join(lines)


def write(path: Path, found: Sequence[ScalingCurve]) -> None:
    """Write the table between its marks, and the picture beside the page."""
    draw(path.parent / PICTURE_FILE_NAME, found)
    before = path.read_text(encoding="utf-8") if path.exists() else f"{BEGIN_MARK}\n{END_MARK}\n"
    picture = f"![Time and memory over the size of the work]({PICTURE_FILE_NAME})"
    content = f"\n\n{markdown_table(found)}\n\n{picture}\n\n"
    write_text(path, replace_between(before, BEGIN_MARK, END_MARK, content))


def draw(path: Path, found: Sequence[ScalingCurve]) -> None:
    """Time and memory over size, in logarithms, one panel for each thing that grows."""
    matplotlib = import_configured("matplotlib")  # late: a process that measures one size does not need it
    from matplotlib.figure import Figure

    kinds = list(dict.fromkeys(g.over for g in found))
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    panels = figure.subplots(len(PANEL_ROWS), len(kinds), squeeze=False)
    for row, (of, label) in zip(panels, PANEL_ROWS, strict=True):
        for axes, over in zip(row, kinds, strict=True):
            draw_panel(axes, [g for g in found if g.over == over], of)
            axes.set_xlabel(over)
            axes.set_ylabel(label)
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context({"svg.hashsalt": path.name}):
        figure.savefig(path, metadata={"Date": None})


def draw_panel(axes, found: Sequence[ScalingCurve], of: str) -> None:
    """One panel; less than a megabyte is drawn as one."""
    least = 1.0 if of == "megabytes" else 0.0
    for number, g in enumerate(found):
        sizes, values = [x.size for x in g.found], [max(getattr(x, of), least) for x in g.found]
        exponent = g.exponent(of) if of == "seconds" or min(values[-2:]) > least else 0.0
        axes.loglog(sizes, values, "o-", color=f"C{number}", label=f"{g.name}: exponent {exponent:.2f}")
    shown = sorted({x.size for g in found for x in g.found})
    axes.set_xticks(shown, [tick_label(x) for x in shown])
    axes.minorticks_off()
    low, high = axes.get_ylim()
    axes.set_ylim(0.3 * low, 20.0 * high)  # room for the names
    axes.legend(fontsize=7)
    axes.grid(alpha=0.3)


def tick_label(size: int) -> str:
    """Label of a size on the axis; from 1000 on only powers of ten have one."""
    power = len(str(size)) - 1
    return str(size) if size < 1000 else f"$10^{power}$" if size == 10**power else ""
