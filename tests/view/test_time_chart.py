"""An hour at 1 kHz is drawn with as many points as a window has pixels, and a second of it with all of its samples."""

import json

import numpy as np
import pytest

from tests.view.serving import needs_nicegui

pytestmark = needs_nicegui
SIGNALS, SAMPLES = 4, 3_600_000


@pytest.fixture(scope="module")
def drawing():
    from wheelpend.view.time_chart import Line, Pane, TimeDrawing

    rng = np.random.default_rng(0)
    t = np.arange(SAMPLES) * 1e-3
    series = np.cumsum(rng.normal(size=(SIGNALS, SAMPLES)), axis=1)
    series[0, 1_000_000:1_000_500] = np.nan
    panes = [Pane(f"signal <{k}>", (Line(lambda window, k=k: series[k, window], "#000000"),)) for k in range(SIGNALS)]
    return TimeDrawing(t, panes), series


def test_an_hour_is_a_bounded_number_of_points_and_bytes_with_its_extremes(drawing):
    drawing, series = drawing
    figure = drawing.figure()
    assert len(figure["data"]) == SIGNALS
    for line, values in zip(figure["data"], series, strict=True):
        shown = np.array(line["y"], dtype=float)
        assert 600 < len(shown) < 1900
        invisible = 5e-5 * float(np.nanmax(values) - np.nanmin(values))
        assert np.nanmax(shown) == pytest.approx(np.nanmax(values), abs=invisible)
        assert np.nanmin(shown) == pytest.approx(np.nanmin(values), abs=invisible)
    assert 50_000 < len(json.dumps(figure)) < 150_000
    assert None in figure["data"][0]["y"] and None not in figure["data"][1]["y"]


def test_a_second_shows_every_sample_and_the_axis_that_was_asked_for(drawing):
    drawing, series = drawing
    figure = drawing.figure(100.0, 100.5)
    line = figure["data"][2]
    assert len(line["x"]) == pytest.approx(501, abs=3)
    near = series[2, 99_990:100_510]
    assert max(np.abs(near - y).min() for y in line["y"]) < 5e-5 * np.ptp(near)
    axes = [value for key, value in figure["layout"].items() if key.startswith("xaxis")]
    assert len(axes) == SIGNALS and all(axis["range"] == [100.0, 100.5] for axis in axes)


def test_what_is_asked_for_beyond_the_log_ends_with_it_and_titles_are_no_markup(drawing):
    drawing, _ = drawing
    figure = drawing.figure(-5.0, 1e9)
    assert figure["layout"]["xaxis"]["range"] == [0.0, pytest.approx(3599.999)]
    assert "<" not in figure["layout"]["yaxis"]["title"]["text"]
