"""Every command gives what it gave when the results in expected/ were recorded."""

import json

import pytest
from brief import EXPECTED, brief
from cases import CHAINS
from differences import json_differs
from running import run_chain
from tolerances import rule


@pytest.mark.parametrize(
    "chain", [pytest.param(c, id=c.name, marks=[pytest.mark.slow] if c.slow else []) for c in CHAINS]
)
def test_a_chain_of_commands_gives_what_is_recorded(chain, tmp_path):
    run_chain(tmp_path, chain)
    expected = json.loads((EXPECTED / f"{chain.name}.json").read_text(encoding="utf-8"))
    found = list(json_differs(expected, brief(tmp_path), rule(chain.name)))
    assert not found, "\n".join([*found, "Intended? Then record anew, see tests/golden/README.md."])


def test_what_is_recorded_is_that_of_the_chains():
    assert sorted(path.stem for path in EXPECTED.glob("*.json")) == sorted(chain.name for chain in CHAINS)


def test_a_difference_is_found_in_a_number_a_key_and_a_text():
    old = {"a": [1.0, {"b": 2.0}], "gone": 0, "text": "error 1.004"}
    new = {"a": [1.0, {"b": 2.00001}], "new": 0, "text": "error 1.104"}
    assert len(list(json_differs(old, new, rule("any")))) == 4
    assert list(json_differs({"b": 2.0}, {"b": 2.0 + 1e-7}, rule("any"))) == []


def test_a_choice_between_two_that_are_alike_may_be_the_other_and_is_one_still():
    place = ".identify.answer.summary.parameters.X4.furthest.log"
    assert list(json_differs("a.csv", "b.csv", rule("campaign"), place)) == []
    assert len(list(json_differs("a.csv", None, rule("campaign"), place))) == 1
    assert len(list(json_differs("a.csv", "b.csv", rule("demo"), place))) == 1
