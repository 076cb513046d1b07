"""Logs behind addresses are logs: listed, fetched, known again, and refused with a reason; against servers of here."""

import json
import threading
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from tests.support import SPARSE_S, run, simulated
from wheelpend import Failure, Model, campaign, parallel, save_log
from wheelpend.campaigns.addresses import address_version, fetched, head_of, is_address, matching, name_of
from wheelpend.campaigns.manifest import Listed, is_manifest, listed_logs

SHORT = 3.0  # s


@pytest.fixture(autouse=True)
def one_core(monkeypatch):
    monkeypatch.setattr(parallel, "cores", lambda: 1)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served")
    for seed in (0, 1):
        save_log(folder / f"drive{seed}.csv", simulated(seed=seed, duration=SHORT, sample=SPARSE_S))
    (folder / "fleet.csv").write_text("log,unit\ndrive0.csv,a\ndrive1.csv,b\ngone.csv,c\n")
    return folder


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *said):
        pass


@contextmanager
def http_server(folder):
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def s3_server(folder, monkeypatch):
    """A bucket with the folder's files, on a server that knows no more of Amazon than its protocol."""
    import boto3
    from moto.server import ThreadedMotoServer
    from s3fs import S3FileSystem

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    address = "http://{}:{}".format(*server.get_host_and_port())
    for name, value in (("AWS_ENDPOINT_URL", address), ("AWS_ACCESS_KEY_ID", "a"), ("AWS_SECRET_ACCESS_KEY", "b"),
                        ("AWS_DEFAULT_REGION", "us-east-1")):  # fmt: skip
        monkeypatch.setenv(name, value)
    client = boto3.client("s3")
    client.create_bucket(Bucket="fleet")
    for path in folder.iterdir():
        client.put_object(Bucket="fleet", Key=path.name, Body=path.read_bytes())
    client.close()
    S3FileSystem.clear_instance_cache()
    try:
        yield "s3://fleet"
    finally:
        S3FileSystem.clear_instance_cache()
        server.stop()


@pytest.fixture(
    params=[
        pytest.param("http", marks=pytest.mark.extras),
        pytest.param("s3", marks=[pytest.mark.extras, pytest.mark.slow]),
    ]
)
def served(request, files, monkeypatch):
    if request.param == "http":
        pytest.importorskip("aiohttp")
        with http_server(files) as address:
            yield address
    else:
        pytest.importorskip("s3fs")
        pytest.importorskip("moto")
        with s3_server(files, monkeypatch) as address:
            yield address


@pytest.mark.slow
def test_a_campaign_of_logs_behind_addresses_says_what_that_of_their_files_says(served, files, tmp_path):
    asked = {"method": "inverse"}
    here = campaign(Model.default(), files / "fleet.csv", **asked).logs
    there = campaign(Model.default(), f"{served}/fleet.csv", keep=tmp_path / "c.results", **asked).logs
    assert [r.unit for r in there] == ["a", "b", "c"]
    assert [r.log for r in there] == [f"{served}/drive0.csv", f"{served}/drive1.csv", f"{served}/gone.csv"]
    assert [r.parameters for r in there] == [r.parameters for r in here]
    assert "must exist" in there[2].failure and there[0].failure is None

    said = []
    campaign(Model.default(), f"{served}/drive*.csv", keep=tmp_path / "c.results", progress=said.append, **asked)
    assert said == ["2 of 2 logs"], "nothing is fetched or compiled again"


def test_a_file_behind_an_address_has_a_version_and_comes_whole(served, files):
    with fetched(f"{served}/drive0.csv") as copy:
        assert copy.name == "drive0.csv" and copy.read_bytes() == (files / "drive0.csv").read_bytes()
    assert not copy.exists()
    first, second = (address_version(f"{served}/drive{k}.csv") for k in (0, 1))
    assert first == address_version(f"{served}/drive0.csv") and first != second
    assert address_version(f"{served}/gone.csv") == ""
    assert is_manifest(f"{served}/fleet.csv") and not is_manifest(f"{served}/drive0.csv")
    assert matching(f"{served}/drive*.csv") == [f"{served}/drive0.csv", f"{served}/drive1.csv"]
    with pytest.raises(Failure, match="none fits"):
        matching(f"{served}/walk*.csv")


@pytest.mark.extras
def test_a_manifest_of_here_may_list_what_is_elsewhere(files, tmp_path, monkeypatch):
    pytest.importorskip("aiohttp")
    monkeypatch.chdir(tmp_path)
    run("new")
    with http_server(files) as address:
        Path("fleet.csv").write_text(f"log,unit\n{address}/drive0.csv,a\n{address}/gone.csv,b\n")
        found = json.loads(run("campaign", "fleet.csv", "--method", "inverse", "--json", "-").stdout)
    assert [(r["unit"], r["failure"] is None) for r in found["logs"]] == [("a", True), ("b", False)]


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("nonsense://a/b.csv", "Protocol not known"),
        ("memory://a.zip::file:///b.csv", "names several"),
        ("memory://nobody/gone.csv", "must exist"),
        ("memory://nobody/gone*.csv", "none fits"),
    ],
)
def test_an_address_that_is_of_no_use_says_why(address, words):
    with pytest.raises(Failure, match=words):
        matching(address) if "*" in address else head_of(address, 10)
    assert "*" in address or listed_logs([address]) == [Listed(address)], "its analysis says why"


def test_a_library_that_is_not_there_is_named(monkeypatch):
    import fsspec

    def absent(*given, **options):
        raise ImportError("Install s3fs to access S3")

    monkeypatch.setattr(fsspec.core, "url_to_fs", absent)
    with pytest.raises(Failure, match="Extras of wheelpend"):
        head_of("s3://bucket/a.csv", 10)


def test_an_address_is_told_from_a_path():
    assert is_address("s3://bucket/a.csv") and is_address("https://host/a.csv?x=1")
    assert not any(map(is_address, ("a.csv", "C:/a.csv", "./s3:/a.csv", Path("s3://bucket/a.csv"), 3)))
    assert name_of("https://host/a.csv?token=1/2#x") == name_of("s3://bucket/b/a.csv") == "a.csv"
    assert (name_of("https://host/.."), name_of("https://host/")) == ("log", "log")
