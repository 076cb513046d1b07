"""Whatever a log, a model, a law or a command line holds, every command keeps to what is promised of all (quick, seeded)."""

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from tests.fuzz.cases import Case
from tests.fuzz.invariants import Broken, check_case
from tests.fuzz.known import KNOWN
from tests.fuzz.properties import PROPERTIES


@pytest.mark.parametrize("name", [name for name, chosen in PROPERTIES.items() if chosen.quick])
def test_every_command_keeps_to_what_is_promised_of_all(name, tmp_path):
    chosen = PROPERTIES[name]

    @settings(
        max_examples=chosen.quick, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck),
        phases=[Phase.generate, Phase.shrink],
    )  # fmt: skip
    @given(case=chosen.cases)
    def holds(case):
        try:
            check_case(case, tmp_path / "a" / "b" / "workspace", chosen.limit_s)
        except Broken as broken:
            if broken.key not in KNOWN:
                raise

    holds()


@pytest.mark.parametrize("case", [Case("x", (("inspect", "\udcff.csv"),), {"a": b"\0\xff"})])
def test_a_case_is_the_same_after_it_was_kept(case):
    assert Case.of_json(case.to_json()) == case
