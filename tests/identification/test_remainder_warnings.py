"""What is said where chance has as much weight as the model."""

import pytest

from wheelpend.identification.remainder import Remainder, RowForce
from wheelpend.identification.remainder_warnings import is_mostly_chance, remainder_warnings
from wheelpend.reports.text.verdict import has_repeating


def left(share):
    return Remainder({"wheel": RowForce(0.2, "V", None, share, 0.1, "wheel")}, places=("wheel",))


@pytest.mark.parametrize(("share", "mostly"), [(0.05, False), (0.49, False), (0.51, True), (13.0, True)])
def test_a_force_of_half_the_weight_of_the_model_is_mostly_chance_and_is_warned_of(share, mostly):
    assert is_mostly_chance(left(share)) is mostly
    assert bool(remainder_warnings(left(share))) is mostly


def test_nothing_left_is_no_chance():
    assert not is_mostly_chance(None) and not is_mostly_chance(Remainder())


def test_a_force_of_which_nothing_is_known_to_repeat_is_not_said_to():
    assert not has_repeating(left(0.8))
