"""What `split` wrote, as lines."""

from __future__ import annotations

from wheelpend.inspection.split import SplitLog


def split_lines(found: SplitLog) -> list[str]:
    """The two files, and the columns that are in neither."""
    rest, held_out = found.samples
    stretch = f"{found.begin_s:g} to {found.end_s:g} s of {found.log}"
    lines = [
        f"Wrote {found.held_out}: {held_out} samples, {stretch}.",
        f"Wrote {found.rest}: the other {rest} samples.",
    ]
    if found.left_out:
        lines.append(f"Left out, since they hold no numbers: {', '.join(found.left_out)}.")
    return lines
