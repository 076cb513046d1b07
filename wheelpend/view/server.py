"""The address of the workbench, the server behind it, and its end by Ctrl-C."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
import tempfile
import webbrowser
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from nicegui import ui

from wheelpend import interruption
from wheelpend.errors import Failure
from wheelpend.view.access import LOOPBACK_HOST, Access, Guard
from wheelpend.view.bench import Bench
from wheelpend.view.jobs import clear_stale_places
from wheelpend.view.layout import show_workbench

PAGE_PREFIX = "open-workbench-"
TICK_S = 0.2  # s between two looks at jobs and workspace
SHUTDOWN_S = 1  # s that open connections have to end


def serve(bench: Bench, port: int, *, opens_browser: bool, say: Callable[[str], object]) -> None:
    """Serve the workbench on this machine until Ctrl-C; ``say`` gets the address.

    Port 0 stands for any that is free. Raises Failure where the port is taken.
    """
    with listening_socket(port) as listening:
        access = Access.new(listening.getsockname()[1])
        config = uvicorn.Config(
            Guard(application(bench), access),
            log_level=logging.WARNING,
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=SHUTDOWN_S,
        )
        interruption.leave_to_main_thread()
        clear_stale_places()
        say(access.address)
        page = opening_page(access.address, bench.folder) if opens_browser else None
        if page is not None:
            webbrowser.open(page.as_uri())
        try:
            uvicorn.Server(config).run(sockets=[listening])
        except KeyboardInterrupt:
            pass  # which is how it ends
        finally:
            bench.close()
            if page is not None:
                page.unlink(missing_ok=True)


def opening_page(address: str, workspace: Path) -> Path:
    """A page that only this user can read and that sends on to the address: a command line, everybody could see.

    It lies in the workspace, since packaged browsers read no temporary folders; what a killed workbench left goes.
    """
    for left in workspace.glob(f"{PAGE_PREFIX}*.html"):
        left.unlink(missing_ok=True)
    folder = workspace if os.access(workspace, os.W_OK) else None
    handle, name = tempfile.mkstemp(prefix=PAGE_PREFIX, suffix=".html", dir=folder)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(f"<!doctype html><title>wheelpend</title><meta http-equiv='refresh' content='0;url={address}'>\n")
    return Path(name)


def listening_socket(port: int) -> socket.socket:
    """A socket that only this machine reaches; raises Failure where the port is taken or is none."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((LOOPBACK_HOST, port))
        listening.listen()  # from now on who opens the address waits for the answer
    except OSError as error:
        listening.close()
        raise Failure(
            f"--port must be a port that is free, but {port} is not: {error.strerror}. "
            "Name another, or leave it out for any that is free."
        ) from error
    return listening


def application(bench: Bench) -> FastAPI:
    """The workbench as an application, with its one page."""

    @contextlib.asynccontextmanager
    async def ticking(app: FastAPI) -> AsyncIterator[None]:
        task = asyncio.create_task(_tick(bench))
        yield
        task.cancel()

    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None, lifespan=ticking)
    ui.page("/")(lambda: show_workbench(bench))
    ui.run_with(
        app,
        title="wheelpend",
        dark=None,
        language="en-US",
        tailwind=False,
        show_welcome_message=False,
        binding_refresh_interval=None,
    )
    return app


async def _tick(bench: Bench) -> None:
    """Look at jobs and workspace again and again, whatever windows are open."""
    while True:
        with contextlib.suppress(OSError):
            bench.tick()
        await asyncio.sleep(TICK_S)
