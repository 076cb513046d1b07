"""Plants that a test makes known are forgotten after it."""

import pytest

from derive import plants


@pytest.fixture(autouse=True)
def shipped_plants_only():
    known = dict(plants.KNOWN_PLANTS)
    yield
    plants.KNOWN_PLANTS.clear()
    plants.KNOWN_PLANTS.update(known)
    plants._built.cache_clear()
