"""Numbers as people read them: the right digits, powers, units and percentages."""

import pytest

from wheelpend.model.units import PlantUnits
from wheelpend.reports import numbers


@pytest.mark.parametrize(
    ("function", "arguments", "text"),
    [
        (numbers.percent_text, (0.256,), "26 %"),
        (numbers.percent_text, (0.256, 1), "25.6 %"),
        (numbers.incomplete_percent_text, (0.996,), "99 %"),
        (numbers.incomplete_percent_text, (0.9996,), "100 %"),
        (numbers.percent_range_text, ((0.05, 0.5),), "5-50"),
        (numbers.fit_text, (96.834,), "96.83"),
        (numbers.fit_text, (-588.0,), "-588.00"),
        (numbers.fit_text, (-1.3e27,), "diverged"),
        (numbers.fit_text, (None,), ""),
        (numbers.estimate_text, (0.123456, 0.00123, "V"), "0.12346 ± 0.0012 V"),
        (numbers.estimate_text, (0.123456, None, "1"), "0.12346"),
        (numbers.typeset_estimate_text, (-0.123456, 0.0123), "−0.123 ± 0.012"),
        (numbers.typeset_estimate_text, (12.3456, 1.23), "12.3 ± 1.2"),
        (numbers.typeset_number_text, (0.0000123,), "1.23×10⁻⁵"),
        (numbers.typeset_number_text, (123456.7,), "123457"),
        (numbers.typeset_number_text, (float("inf"),), "–"),
        (numbers.positional_number_text, (0.00123,), "0.0012"),
        (numbers.positional_number_text, (1.23e-7,), "1.2·10⁻⁷"),
        (numbers.range_text, (0.1, 0.25), "0.1 to 0.25"),
        (numbers.range_text, (0.1, 0.1), "0.1"),
        (numbers.typeset_p_value_text, (1e-13,), "< 10⁻¹²"),
        (numbers.typeset_p_value_text, (0.034,), "0.03"),
        (numbers.error_text, (1.0,), "1.000"),
        (numbers.time_text, (0.0123,), "12.3 ms"),
        (numbers.time_text, (0.99999e-3,), "1 ms"),
        (numbers.time_text, (2.5e-6, "step"), "2.5 µs/step"),
        (numbers.unit_text, ("V s/rad",), "V·s/rad"),
        (numbers.physical_text, (2.0, "V s/rad", PlantUnits({}, "V", 0.25, "N·m"), 3), "0.5 N·m s/rad"),
    ],
)
def test_a_number_reads_as_it_should(function, arguments, text):
    assert function(*arguments) == text
