"""The workbench's server, asked without a browser."""

import base64
import socket
from http.cookies import SimpleCookie
from urllib.parse import urlsplit

import pytest

from tests.support import run
from tests.view.serving import answer, end_by_interrupt, needs_nicegui, serving
from wheelpend import Model
from wheelpend.cli import view as command

pytestmark = [pytest.mark.extras]


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("view")
    Model.default().save(folder)
    return folder


@pytest.fixture(scope="module")
def address(workspace):
    with serving(workspace) as (found, _):
        yield found


@pytest.fixture(scope="module")
def cookie(address):
    found = SimpleCookie(answer(address)[1]["Set-Cookie"])
    return "; ".join(f"{name}={part.value}" for name, part in found.items())


def bare(address):
    return address.partition("?")[0]


@needs_nicegui
def test_the_address_opens_the_page_and_nothing_of_it_comes_from_elsewhere(address, cookie):
    status, headers, page = answer(bare(address), Cookie=cookie)
    assert status == 200 and "connect-src 'self'" in headers["Content-Security-Policy"]
    assert 'src="http' not in page and 'href="http' not in page


@needs_nicegui
@pytest.mark.parametrize("path", ["", "_nicegui/static/nicegui.css", "model.toml", "_nicegui_ws/socket.io/?EIO=4"])
def test_nothing_is_served_without_the_token(address, path):
    assert answer(bare(address) + path)[0] == 403
    assert answer(f"{bare(address)}{path}{'&' if '?' in path else '?'}token=wrong")[0] == 403


@needs_nicegui
def test_other_origins_and_hosts_are_refused_though_they_know_the_token(address, cookie):
    assert answer(address, Origin="http://evil.example")[0] == 403
    assert answer(address, Host="evil.example")[0] == 403
    assert answer(bare(address), Cookie=cookie, Sec_Fetch_Site="same-site")[0] == 403


@needs_nicegui
@pytest.mark.parametrize(
    "path", ["model.toml", "../model.toml", "..%2fmodel.toml", "docs", "openapi.json", "%2fetc/passwd"]
)
def test_no_file_is_served_that_is_not_of_the_page(address, cookie, path):
    assert answer(bare(address) + path, Cookie=cookie)[0] == 404


def upgraded(address, **headers):
    """The first line that answers a request for a websocket."""
    parts = urlsplit(address)
    said = {
        "Host": parts.netloc,
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": base64.b64encode(b"0" * 16).decode(),
    } | headers
    lines = [
        "GET /_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1",
        *(f"{name}: {value}" for name, value in said.items()),
    ]
    with socket.create_connection((parts.hostname, parts.port), timeout=10) as connection:
        connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        return connection.recv(200).decode("latin-1").splitlines()[0]


@needs_nicegui
def test_a_websocket_opens_for_the_workbenchs_own_page_alone(address, cookie):
    own = bare(address).rstrip("/")
    assert "101" in upgraded(address, Cookie=cookie, Origin=own)
    assert "403" in upgraded(address, Origin=own)
    assert "403" in upgraded(address, Cookie=cookie, Origin="http://evil.example")
    assert "403" in upgraded(address, Cookie=cookie, Host="evil.example")


@needs_nicegui
def test_only_this_machine_reaches_it(address):
    others = {found[4][0] for found in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)} - {"127.0.0.1"}
    for host in {*others, "127.0.0.2"}:
        with pytest.raises(OSError), socket.create_connection((host, urlsplit(address).port), timeout=2):
            pass


@needs_nicegui
def test_ctrl_c_ends_it_and_says_how_to_go_on(workspace):
    before = sorted(workspace.iterdir())
    with serving(workspace) as (found, process):
        answer(found)
        code, said = end_by_interrupt(process)
    assert code == 0 and "wheelpend view --model" in said and "Traceback" not in said
    assert sorted(workspace.iterdir()) == before, "it leaves no file of its own"


@needs_nicegui
def test_a_port_that_is_taken_is_named(workspace, address):
    port = urlsplit(address).port
    said = run("view", "--no-browser", "--model", workspace, "--port", port, code=1).output
    assert f"--port must be a port that is free, but {port} is not" in said


def test_without_the_extra_it_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(command, "require", lambda *asked: (_ for _ in ()).throw(command.Failure(" ".join(asked))))
    assert "nicegui view" in run("view", "--no-browser", code=1).output


def test_the_demo_brings_its_own_logs():
    assert "--demo brings its own logs" in run("view", "--demo", "--model", "robot", code=1).output.replace("\n", " ")
