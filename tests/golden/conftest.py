"""The marker of chains that take long, and leaving them out unless they are asked for."""

import pytest


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: takes more than a few seconds; runs with `-m slow`")


def pytest_collection_modifyitems(config, items):
    """Slow chains run only where a marker expression or the test's own name asks for them."""
    if config.option.markexpr or any("test_golden" in argument for argument in config.args):
        return
    for item in items:
        if item.get_closest_marker("slow") and item.path.parent.name == "golden":
            item.add_marker(pytest.mark.skip(reason="takes long; run it with `pytest tests/golden -m slow`"))
