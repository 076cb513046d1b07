"""Which parameters of a fit mean something."""

from types import SimpleNamespace

import pytest

from wheelpend.estimation import parameter_table

VALUES = {"X1": 1e5, "X2": 0.05, "X3": 0.0, "X4": 4e10, "coulomb_drive.torque": 0.0}
SIGMA = {"X1": 2.0, "X2": 7e8, "X3": 0.001, "X4": 7e11, "coulomb_drive.torque": 1.0}
UNITS = {"X1": "V s²", "X2": "V s²", "X3": "V s²", "X4": "V s", "coulomb_drive.torque": "V"}


@pytest.mark.parametrize(("error", "runaway"), [(8.0, {"X2", "X4"}), (1.05, set()), (2.9, set())])
def test_in_a_fit_that_went_astray_an_error_beyond_all_values_of_its_unit_means_nothing(monkeypatch, error, runaway):
    monkeypatch.setattr(parameter_table, "standard_error", lambda problem, fitted, name: SIGMA[name])
    module = SimpleNamespace(PARAMETERS=tuple(UNITS), UNITS=tuple(UNITS.values()))
    fitted = SimpleNamespace(error=error, of_log=lambda number: VALUES)
    problem = SimpleNamespace(module=module, floor=1.0)
    assert parameter_table._runaway_names(problem, fitted, list(VALUES)) == runaway
