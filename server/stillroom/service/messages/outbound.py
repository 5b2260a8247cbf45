"""Requests to addresses that people gave: none reaches the inner network, and none can take long.

The name is resolved here, every address that it has is judged, and the connection goes to one that was judged: what the name
resolves to a moment later does not matter. Redirects are not followed, proxies of the environment not used.
"""

import socket
import ssl
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address
from time import monotonic
from typing import Any
from urllib.parse import urlsplit

import httpcore2

from stillroom.errors import Fault, InvalidInput
from stillroom.settings import Outbound

TOTAL_S = 15.0
"""One request takes no longer, however slowly the other end answers."""
MOST_BYTES = 64 * 1024
"""Of an answer; nobody reads more."""
Ip = IPv4Address | IPv6Address
Resolve = Callable[[str, int], list[str]]
"""(name, port) -> addresses."""
_EMBEDDED = tuple(map(IPv6Network, ("::/96", "64:ff9b::/96", "64:ff9b:1::/48", "::ffff:0:0:0/96")))
"""IPv6 addresses that stand for the IPv4 address in their last 32 bits."""
_NEVER_PUBLIC = frozenset([ip_address("168.63.129.16")])
"""Looks public and is none: a cloud's address for its own machines."""


class Forbidden(httpcore2.ConnectError):
    """The address is not one that requests may go to."""


@dataclass(frozen=True)
class Answer:
    status: int
    headers: Mapping[str, str]
    """Names in lower case."""


def check_url(url: str, outbound: Outbound, pointer: str) -> None:
    """What can be said without asking for the name's address. Raises InvalidInput, about the member at `pointer`."""
    problem = _problem_of(url, outbound)
    if problem is not None:
        raise InvalidInput("Nothing can be sent to this URL.", (Fault(pointer, problem),))


def _problem_of(url: str, outbound: Outbound) -> str | None:
    try:
        parts = urlsplit(url)
        host, _ = parts.hostname, parts.port
    except ValueError as error:
        return str(error)
    if parts.scheme != "https" and not (outbound.insecure_http and parts.scheme == "http"):
        return "It must begin with https://."
    if not host:
        return "It names no host."
    if parts.username is not None or parts.password is not None or parts.fragment:
        return "It must have no user, password or fragment."
    try:
        literal = ip_address(host)
    except ValueError:
        return None
    return None if is_allowed(literal, outbound) else f"{literal} is not a public address."


def is_allowed(address: Ip, outbound: Outbound) -> bool:
    """Whether requests may go there: public, or in one of the networks that the settings name."""
    real = unwrapped(address)
    if any(one in network for network in outbound.networks for one in (address, real)):
        return True
    if isinstance(real, IPv6Address) and real.is_site_local:
        return False
    return real.is_global and not real.is_multicast and not real.is_reserved and real not in _NEVER_PUBLIC


def unwrapped(address: Ip) -> Ip:
    """The IPv4 address that an IPv6 address leads to, where it is one of those."""
    if isinstance(address, IPv4Address):
        return address
    embedded = address.ipv4_mapped or address.sixtofour or (address.teredo and address.teredo[1])
    if embedded:
        return embedded
    if any(address in network for network in _EMBEDDED):
        return IPv4Address(int(address) & 0xFFFFFFFF)
    return address


def resolve(name: str, port: int) -> list[str]:
    return [str(found[4][0]) for found in socket.getaddrinfo(name, port, type=socket.SOCK_STREAM)]


def post(
    url: str,
    headers: Mapping[str, str],
    body: bytes,
    outbound: Outbound,
    resolve: Resolve = resolve,
    total_s: float = TOTAL_S,
) -> Answer:
    """Sends it. Raises httpcore2's errors: Forbidden, NetworkError, TimeoutException, ProtocolError; OSError where TLS fails."""
    backend = _Backend(outbound, resolve, monotonic() + total_s)
    limits = dict.fromkeys(("connect", "read", "write", "pool"), total_s)
    with (
        httpcore2.ConnectionPool(ssl_context=ssl.create_default_context(), network_backend=backend) as pool,
        pool.stream("POST", url, headers=list(headers.items()), content=body, extensions={"timeout": limits}) as answer,
    ):
        got = 0
        for chunk in answer.iter_stream():
            got += len(chunk)
            if got > MOST_BYTES:
                break
        return Answer(answer.status, {name.decode().lower(): value.decode("latin-1") for name, value in answer.headers})


class _Backend(httpcore2.NetworkBackend):
    """Connects to judged addresses only, until a moment at which everything ends."""

    def __init__(self, outbound: Outbound, resolve: Resolve, until: float) -> None:
        self._outbound, self._resolve, self._until = outbound, resolve, until
        self._real = httpcore2.SyncBackend()

    def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[Any] | None = None,
    ) -> httpcore2.NetworkStream:
        failure: Exception = httpcore2.ConnectError(f"{host} has no address.")
        for address in self._judged(host, port):
            try:
                stream = self._real.connect_tcp(
                    address, port, _left(self._until, timeout), local_address, socket_options
                )
                return _Stream(stream, self._until)
            except (httpcore2.ConnectError, httpcore2.ConnectTimeout) as error:
                failure = error
        raise failure

    def _judged(self, host: str, port: int) -> list[str]:
        """Addresses of a host. One that may not be reached spoils them all: a name has no business with both."""
        try:
            found = list(dict.fromkeys(self._resolve(host.strip("[]"), port)))
        except OSError as error:
            raise httpcore2.ConnectError(f"The name {host} can't be resolved.") from error
        for address in found:
            if not is_allowed(ip_address(address.partition("%")[0]), self._outbound):
                # without the address: who gave the name must not learn by it what names mean inside
                raise Forbidden(f"The name {host} leads to an address that is not public; nothing was sent.")
        return found


class _Stream(httpcore2.NetworkStream):
    """Ends at a moment, however much the other end makes of every single wait."""

    def __init__(self, real: httpcore2.NetworkStream, until: float) -> None:
        self._real, self._until = real, until

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        return self._real.read(max_bytes, _left(self._until, timeout))

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        self._real.write(buffer, _left(self._until, timeout))

    def close(self) -> None:
        self._real.close()

    def start_tls(
        self, ssl_context: ssl.SSLContext, server_hostname: str | None = None, timeout: float | None = None
    ) -> httpcore2.NetworkStream:
        return _Stream(self._real.start_tls(ssl_context, server_hostname, _left(self._until, timeout)), self._until)

    def get_extra_info(self, info: str) -> Any:
        return self._real.get_extra_info(info)


def _left(until: float, timeout: float | None) -> float:
    left = until - monotonic()
    if left <= 0:
        raise httpcore2.ReadTimeout("It took too long.")
    return left if timeout is None else min(left, timeout)
