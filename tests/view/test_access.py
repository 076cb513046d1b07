"""Who may ask the workbench anything."""

import asyncio

import pytest

from wheelpend.view.access import POLICY_REFUSAL, Access, Guard

ACCESS = Access(8470, "the-token")
COOKIE = {"host": "127.0.0.1:8470", "cookie": "a=b; wheelpend_8470=the-token"}


def test_a_token_is_new_each_time_and_long():
    first, second = Access.new(1), Access.new(1)
    assert first.token != second.token and len(first.token) >= 43
    assert first.address == f"http://127.0.0.1:1/?token={first.token}"


@pytest.mark.parametrize("host", ["127.0.0.1:8470", "localhost:8470"])
def test_the_token_of_the_address_or_of_the_cookie_opens(host):
    assert not ACCESS.refusal({"host": host}, "token=the-token")
    assert not ACCESS.refusal(COOKIE | {"host": host}, "")
    assert not ACCESS.refusal(COOKIE | {"origin": f"http://{host}", "sec-fetch-site": "same-origin"}, "")


@pytest.mark.parametrize("query", ["", "token=", "token=another", "token=the-tokenn", "Token=the-token"])
def test_without_the_token_nothing_opens(query):
    assert "token" in ACCESS.refusal({"host": "127.0.0.1:8470"}, query)


@pytest.mark.parametrize("cookie", ["wheelpend_8470=x", "wheelpend_8471=the-token", "=", "wheelpend_8470", "\x00"])
def test_another_cookie_does_not_open(cookie):
    assert "token" in ACCESS.refusal(COOKIE | {"cookie": cookie}, "")


@pytest.mark.parametrize("host", ["", "evil.example", "evil.example:8470", "127.0.0.1", "127.0.0.1:80", "0.0.0.0:8470"])
def test_a_name_that_was_bent_to_this_machine_is_refused_token_or_not(host):
    assert "host" in ACCESS.refusal(COOKIE | {"host": host}, "token=the-token")


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1:9", "https://127.0.0.1:8470", "http://127.0.0.1:8470.x"]
)
def test_another_page_is_refused_token_or_not(origin):
    assert "another page" in ACCESS.refusal(COOKIE | {"origin": origin}, "token=the-token")


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_request_of_another_page_that_names_no_origin_is_refused(site):
    assert "own page" in ACCESS.refusal(COOKIE | {"sec-fetch-site": site}, "")


def answered(kind, headers, query=b"", path="/"):
    """What a guarded application sends."""
    sent = []

    async def app(scope, receive, send):
        await send({"type": f"{kind}.response.start" if kind == "http" else "websocket.accept", "status": 200})

    async def send(message):
        sent.append(message)

    scope = {
        "type": kind,
        "path": path,
        "query_string": query,
        "headers": [(n.encode(), v.encode()) for n, v in headers.items()],
    }
    asyncio.run(Guard(app, ACCESS)(scope, None, send))
    return sent


def test_a_websocket_is_guarded_as_pages_are():
    assert answered("websocket", COOKIE)[0]["type"] == "websocket.accept"
    for headers in ({"host": "127.0.0.1:8470"}, COOKIE | {"origin": "http://evil.example"}, COOKIE | {"host": "evil"}):
        assert [(m["type"], m["code"]) for m in answered("websocket", headers)] == [("websocket.close", POLICY_REFUSAL)]


def test_the_first_answer_gives_the_cookie_and_forgets_the_token():
    start, body = answered("http", {"host": "127.0.0.1:8470"}, b"token=the-token")
    headers = dict(start["headers"])
    assert headers[b"set-cookie"] == b"wheelpend_8470=the-token; Path=/; HttpOnly; SameSite=Strict"
    assert b"the-token" not in body["body"] and b"url=/'" in body["body"]


def test_every_answer_forbids_what_the_page_does_not_need():
    for sent in (answered("http", COOKIE), answered("http", {"host": "evil"})):
        headers = dict(sent[0]["headers"])
        assert b"default-src 'self'" in headers[b"content-security-policy"] and headers[b"x-frame-options"] == b"DENY"


def test_a_header_that_comes_twice_is_none_of_the_known_ones():
    twice = [(b"host", b"127.0.0.1:8470"), (b"host", b"127.0.0.1:8470"), (b"cookie", b"wheelpend_8470=the-token")]
    sent = []

    async def send(message):
        sent.append(message)

    scope = {"type": "http", "path": "/", "query_string": b"", "headers": twice}
    asyncio.run(Guard(None, ACCESS)(scope, None, send))
    assert sent[0]["status"] == 403
