"""The page: the steps of the work from top to bottom, under a line that says what runs and what comes next."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from wheelpend.view.add_panel import AddPanel
from wheelpend.view.bench import Bench
from wheelpend.view.compare_panel import ComparePanel
from wheelpend.view.go_on_panel import GoOnPanel
from wheelpend.view.hints import next_step
from wheelpend.view.learn_panel import LearnPanel
from wheelpend.view.open_panel import OpenPanel
from wheelpend.view.panel import Panel, window_refreshes
from wheelpend.view.see_panel import SeePanel
from wheelpend.view.status_line import StatusLine
from wheelpend.view.what_if_panel import WhatIfPanel

PANEL_TYPES: tuple[type[Panel], ...] = (
    OpenPanel,
    ComparePanel,
    SeePanel,
    WhatIfPanel,
    LearnPanel,
    AddPanel,
    GoOnPanel,
)
STYLE_FILE = Path(__file__).parent / "view.css"
REFRESH_S = 0.3  # s between two looks at what changed


def show_workbench(bench: Bench) -> None:
    """Lay out the workbench for a window that opens, and keep it as the bench is."""
    ui.add_css(STYLE_FILE.read_text(encoding="utf-8"))
    dark = ui.dark_mode(None)
    with ui.element("div").classes("page"):
        with ui.element("header"):
            with ui.element("h1"):
                ui.label("wheelpend").classes("plain")
            ui.label(str(bench.folder)).classes("soft folder")
            ui.button("Dark or light", on_click=lambda: _turn(dark), color=None).props("no-caps flat").classes("action")
        links = _show_steps()
        status = StatusLine(bench)
        with ui.element("div").classes("panels"):
            panels = [panel(bench) for panel in PANEL_TYPES]
    with ui.element("div").style("display: none"):
        ui.plotly({"data": [], "layout": {}})  # so that the browser loads its drawing library before the first chart

    def refresh() -> None:
        status.update()
        now = next_step(bench).panel
        for panel in panels:
            panel.update()
            for part in (links[panel.name], panel.section):
                part.classes(**{"add" if panel.name == now else "remove": "now"})

    refresh()
    window_refreshes[ui.context.client] = refresh
    ui.timer(REFRESH_S, refresh)


def _show_steps() -> dict[str, ui.element]:
    """The way of working, as links to its steps."""
    links: dict[str, ui.element] = {}
    with ui.element("nav").props('aria-label="Steps of the work"'):
        for panel in PANEL_TYPES:
            links[panel.name] = ui.link(panel.title, f"#{panel.name}").classes("step")
    return links


def _turn(dark: ui.dark_mode) -> None:
    """From the system's choice to dark, to light, and so on."""
    dark.set_value({None: True, True: False, False: None}[dark.value])
