"""The summary of the benchmark as docs/benchmark.md, after the template page.md."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from wheelpend.benchmarks.hidden_effects.summary import Summary
from wheelpend.benchmarks.markdown import markdown_table
from wheelpend.proportion import Proportion
from wheelpend.reports.numbers import fixed_number_text, percent_range_text, percent_text

PAGE_TEMPLATE_PATH = Path(__file__).with_name("page.md")
NOT_TRIED = "not tried"  # in place of a rate or a number
UNBOUNDED_SIZE = 1e9  # standard deviations: upper edge from which a bin of sizes has no end
TableRow = tuple[str, ...]


def page_text(summary: Summary, planned: int) -> str:
    """The page in Markdown; ``planned`` is the number of logs in the whole benchmark."""
    unusable = f", {len(summary.failures)} could not be used" if summary.failures else ""
    findings = [*hit_rate_rows(summary), *false_answer_rows(summary), *accuracy_rows(summary)]
    page = PAGE_TEMPLATE_PATH.read_text(encoding="utf-8").format(
        cases=summary.cases,
        planned=planned,
        unusable=unusable,
        findings=markdown_table(("", "measured", "goal"), findings),
        by_size=markdown_table(("size", "first answer right"), size_rows(summary)),
        spread=markdown_table(
            ("parameter", "spread"), [(name, f"{value:.2f}") for name, value in summary.spread.items()]
        ),
        answers=markdown_table(("hidden", "right", "answers"), answer_rows(summary)),
    )
    return "\n\n".join([page.rstrip(), *exception_sections(summary)]) + "\n"


def hit_rate_rows(summary: Summary) -> Iterator[TableRow]:
    """Rows on single effects, pairs and triples: the rate at which the hidden effects are found."""
    singles = summary.singles
    every = Proportion(sum(r.hits for r in singles.values()), sum(r.of for r in singles.values()))
    yield (
        "first answer right or declared equivalent, one effect that costs at least 5 % of error",
        rate_text(every),
        "≥ 98 %",
    )
    for source, rate in singles.items():
        yield f"… logs from the {source}", rate_text(rate), ""
    yield "… dry friction that engages slowly", rate_text(summary.soft), ""
    yield "mean number of declared equivalents", fixed_number_text(summary.equivalents, 2, NOT_TRIED), ""
    yield "both effects of a pair found, each costing at least 5 % beside the other", rate_text(summary.pairs), "≥ 95 %"
    yield "… pairs of which one costs less", rate_text(summary.faint), ""
    yield "all three of a triple found", rate_text(summary.triples), ""


def false_answer_rows(summary: Summary) -> Iterator[TableRow]:
    """Rows on logs whose right answer is that no effect of the library is missing."""
    left_out = rate_text(summary.left_out)
    yield "false alarms on complete models", rate_text(summary.false_alarms), "≤ 2 of 200"
    yield "guilty effect left out: unexplained, or a stand-in that reaches the noise", left_out, "≥ 95 %"
    yield "… confident name whose error stays above 1.1 times the floor", str(summary.overconfident), "0"


def accuracy_rows(summary: Summary) -> Iterator[TableRow]:
    """Rows on errors and estimates against those of the true model, and on sticking, which its law must describe."""
    widest = max(summary.spread.values(), default=float("nan"))
    spread = (
        f"largest spread of a parameter's estimates over the predicted one, complete models ({summary.estimated} logs)"
    )
    stick_slip = rate_text(summary.stick_slip)
    yield "error after at most 1.05 times the true model's", rate_text(summary.near_truth), "all"
    yield "… largest ratio", fixed_number_text(summary.worst, 3, NOT_TRIED), "≤ 1.05"
    yield "true values inside 95 % intervals", rate_text(summary.coverage), "92 to 98 %"
    yield spread, fixed_number_text(widest, 2, NOT_TRIED), "≤ 1.15"
    yield "dry friction that truly sticks, sampled at 1 kHz: first answer right", stick_slip, "≥ 98 %"
    yield "… largest error of the true model", fixed_number_text(summary.sticking, 3, NOT_TRIED), "≤ 1.05"


def size_rows(summary: Summary) -> Iterator[TableRow]:
    """Hit rate in every bin of hidden sizes that has logs."""
    for low, high, rate in summary.by_size:
        if rate.of:
            yield f"{low:g} to {high:g}" if high < UNBOUNDED_SIZE else f"above {low:g}", rate_text(rate)


def answer_rows(summary: Summary) -> Iterator[TableRow]:
    """Hit rate and first answers of every hidden effect, the most common answer first."""
    for effect, answers in summary.confusion.items():
        counts = ", ".join(f"{name} {count}" for name, count in answers.most_common())
        yield effect, rate_text(summary.by_effect[effect]), counts


def exception_sections(summary: Summary) -> Iterator[str]:
    """Headings and lists of the logs that are not as planned, where there are any."""
    if summary.redrawn:
        yield "## Logs made with smaller effects than planned, because the robot fell"
        yield "\n".join(f"- {key}" for key in summary.redrawn)
    if summary.failures:
        yield "## Logs that could not be used"
        yield "\n".join(f"- {failure}" for failure in summary.failures)


def rate_text(rate: Proportion) -> str:
    """Hits, trials, percentage and 95 % confidence interval."""
    if not rate.of:
        return NOT_TRIED
    return f"{rate.hits} of {rate.of}, {percent_text(rate.share, 1)} ({percent_range_text(rate.interval, '–')})"
