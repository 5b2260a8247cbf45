"""No request that somebody asks for reaches the inner network, and none takes long."""

import socket
import threading
from http.server import BaseHTTPRequestHandler
from ipaddress import ip_address, ip_network
from pathlib import Path

import httpcore2
import pytest

from stillroom.errors import InvalidInput
from stillroom.service.messages.outbound import Forbidden, check_url, is_allowed, post
from stillroom.settings import Outbound
from tests.service.messages.certificates import self_signed
from tests.telling import HERE, Names, answering, receiving, silent

PUBLIC = ["8.8.8.8", "93.184.215.14", "2606:4700:4700::1111"]
INNER = [
    "127.0.0.1", "127.8.9.1", "10.0.0.1", "172.16.3.4", "192.168.1.1", "169.254.169.254", "100.64.0.1", "100.100.100.200",
    "0.0.0.0", "224.0.0.1", "239.1.2.3", "255.255.255.255", "240.0.0.1", "192.0.2.1", "198.18.0.1", "168.63.129.16",
    "::", "::1", "fe80::1", "fc00::1", "fd00:ec2::254", "fec0::1", "ff02::1", "ff0e::1", "2001:db8::1",
    "::ffff:127.0.0.1", "::ffff:10.0.0.1", "::ffff:169.254.169.254", "::ffff:0:127.0.0.1", "::127.0.0.1",
    "64:ff9b::127.0.0.1", "64:ff9b::10.0.0.1", "64:ff9b:1::10.0.0.1", "2002:7f00:1::", "2002:a00:1::1",
    "2001:0:4136:e378:8000:63bf:f5ff:fffe",
]  # fmt: skip


@pytest.mark.parametrize("address", PUBLIC)
def test_public_addresses_may_be_reached(address: str) -> None:
    assert is_allowed(ip_address(address), Outbound())


@pytest.mark.parametrize("address", INNER)
def test_addresses_of_the_inner_network_may_not_be_reached_however_they_are_written(address: str) -> None:
    assert not is_allowed(ip_address(address), Outbound())


def test_settings_allow_a_network_and_no_other() -> None:
    outbound = Outbound((ip_network("10.1.0.0/16"), ip_network("fd12::/16")))
    for address, allowed in (
        ("10.1.2.3", True),
        ("::ffff:10.1.2.3", True),
        ("10.2.0.1", False),
        ("fd12::1", True),
        ("fd13::1", False),
    ):
        assert is_allowed(ip_address(address), outbound) is allowed, address


@pytest.mark.parametrize(
    ("url", "problem"),
    [
        ("http://example.org/", "https://"),
        ("ftp://example.org/", "https://"),
        ("https:///path", "no host"),
        ("https://user:secret@example.org/", "user"),
        ("https://user@example.org/", "user"),
        ("https://example.org/#part", "fragment"),
        ("https://example.org:99999/", "ort"),
        ("https://127.0.0.1/", "not a public address"),
        ("https://[::1]/", "not a public address"),
        ("https://[::ffff:10.0.0.1]/", "not a public address"),
        ("https://169.254.169.254/latest/meta-data", "not a public address"),
    ],
)
def test_a_url_that_nothing_can_be_sent_to_is_refused_at_once(url: str, problem: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        check_url(url, Outbound(), "/url")
    assert refused.value.faults[0].pointer == "/url"
    assert problem in refused.value.faults[0].detail


def test_a_url_with_a_name_is_taken() -> None:
    check_url("https://hooks.example.org:8443/a?b=c", Outbound(), "/url")


@pytest.mark.parametrize(
    "url",
    [
        "http://rebound.example:{port}/",
        "http://2130706433:{port}/",
        "http://0x7f.1:{port}/",
        "http://localhost:{port}/",
    ],
)
def test_a_name_that_leads_to_the_inner_network_is_not_connected_to(url: str) -> None:
    with receiving() as inner:
        names = Names(
            {
                "rebound.example": [["127.0.0.1"]],
                "2130706433": [["127.0.0.1"]],
                "0x7f.1": [["127.0.0.1"]],
                "localhost": [["::1", "127.0.0.1"]],
            }
        )
        with pytest.raises(Forbidden, match="nothing was sent"):
            post(url.format(port=inner.port), {}, b"x", Outbound(insecure_http=True), names)
        assert inner.requests == []


def test_a_name_with_a_public_and_an_inner_address_is_not_connected_to() -> None:
    with receiving() as inner:
        names = Names({"both.example": [["127.0.0.1", "10.0.0.1"]]})
        with pytest.raises(Forbidden):
            post(f"http://both.example:{inner.port}/", {}, b"x", HERE, names)
        assert inner.requests == []


def test_a_name_that_changes_after_it_was_judged_changes_nothing() -> None:
    """DNS rebinding: the connection goes to the address that was judged, and the name is asked for once."""
    with receiving() as allowed:
        names = Names({"rebinding.example": [["127.0.0.1"], ["127.0.0.2"]]})
        answer = post(f"http://rebinding.example:{allowed.port}/hook", {}, b"x", HERE, names)
        assert (answer.status, names.asked) == (204, ["rebinding.example"])
        assert allowed.requests[0].headers["host"] == f"rebinding.example:{allowed.port}"
        with pytest.raises(Forbidden):
            post(f"http://rebinding.example:{allowed.port}/hook", {}, b"x", HERE, names)
        assert len(allowed.requests) == 1


def test_the_next_address_is_tried_where_one_does_not_answer() -> None:
    outbound = Outbound((ip_network("127.0.0.0/30"),), insecure_http=True)
    with receiving() as there:
        names = Names({"two.example": [["127.0.0.2", "127.0.0.1"]]})
        assert post(f"http://two.example:{there.port}/", {}, b"x", outbound, names).status == 204


@pytest.mark.parametrize("status", [301, 302, 303, 307, 308])
def test_redirects_are_not_followed(status: int) -> None:
    with receiving() as inner, receiving() as there:
        there.behaviour = answering(status, {"Location": inner.url})
        assert post(there.url, {}, b"x", HERE).status == status
        assert (len(there.requests), inner.requests) == (1, [])


def test_proxies_of_the_environment_are_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    with receiving() as proxy, receiving() as there:
        for name in ("http_proxy", "HTTP_PROXY", "ALL_PROXY"):
            monkeypatch.setenv(name, f"http://127.0.0.1:{proxy.port}")
        assert post(there.url, {}, b"x", HERE).status == 204
        assert proxy.requests == []


def test_an_answer_without_end_is_not_read_to_its_end() -> None:
    stopped = threading.Event()

    def endless(request: BaseHTTPRequestHandler) -> None:
        request.send_response(200)
        request.end_headers()
        try:
            while True:
                request.wfile.write(b"x" * 65536)
        except OSError:
            stopped.set()

    with receiving() as there:
        there.behaviour = endless
        assert post(there.url, {}, b"x", HERE).status == 200
        assert stopped.wait(60)


def test_an_answer_that_trickles_ends_when_its_time_is_over() -> None:
    gone = threading.Event()

    def trickle(request: BaseHTTPRequestHandler) -> None:
        try:
            while not gone.wait(0.05):
                request.wfile.write(b"H")  # each single wait is short
                request.wfile.flush()
        except OSError:
            gone.set()

    with receiving() as there:
        there.behaviour = trickle
        with pytest.raises(httpcore2.TimeoutException):
            post(there.url, {}, b"x", HERE, total_s=0.5)
        assert gone.wait(60)


def test_a_receiver_that_never_answers_ends_when_its_time_is_over() -> None:
    with silent() as port, pytest.raises(httpcore2.TimeoutException):
        post(f"http://127.0.0.1:{port}/", {}, b"x", HERE, total_s=0.3)


def test_certificates_are_judged_by_the_name_of_the_url(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = Names({name: [["127.0.0.1"]] for name in ("hooks.example", "other.example")})
    with receiving(self_signed(tmp_path, "hooks.example")) as there:
        port = there.port
        with pytest.raises(httpcore2.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
            post(f"https://hooks.example:{port}/", {}, b"x", HERE, names)
        monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "certificate.pem"))  # from now on somebody vouches for it
        assert post(f"https://hooks.example:{port}/", {}, b"x", HERE, names).status == 204
        with pytest.raises(httpcore2.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
            post(f"https://other.example:{port}/", {}, b"x", HERE, names)


def test_a_name_that_nobody_has_can_not_be_reached() -> None:
    def nobody(_name: str, _port: int) -> list[str]:
        raise socket.gaierror("unknown")

    with pytest.raises(httpcore2.ConnectError, match="can't be resolved"):
        post("https://nobody.invalid/", {}, b"x", Outbound(), nobody)
