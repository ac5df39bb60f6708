"""What is answered: names of this machine, no page of another origin, a token, so many a second.

And requests of so many bytes at most, which arrive in time.
"""

from __future__ import annotations

import hmac
import ipaddress
from collections import OrderedDict
from collections.abc import Callable, Collection, Mapping
from time import monotonic

from sgm.messages import shorten_text

LOCAL_NAMES = frozenset(("127.0.0.1", "localhost", "[::1]"))
MOST_CLIENTS = 1000  # addresses whose rates are kept
DEFAULT_RATE = 1000.0  # requests of one address in a second
_BURST_SECONDS = 2.0  # of the rate, at once
MOST_BYTES = 256 << 10  # of the body of a request
BODY_SECONDS = 10.0  # in which it has to arrive
MOST_LINE = 500  # characters of an error
OPEN_PATHS = frozenset(("/health",))  # answered without a token: it says nothing of the home


class Refused(Exception):
    """A request that is not answered.

    Attributes:
        status: of HTTP.
        line: why, and what to do.
        headers: that the status demands, beside those of every answer.
    """

    def __init__(self, status: int, line: str, headers: Mapping[str, str] | None = None) -> None:
        """Refuse with a status and a line."""
        super().__init__(line)
        self.status = status
        self.line = line
        self.headers = headers


class Guard:
    """Refuses requests before anything else is done with them.

    A page in a browser may send requests to any address, under a name of its own that leads to this
    machine. So the `Host` must be a name of this server, and `Origin` and `Sec-Fetch-Site`, which
    browsers send, must say that the page is one of this server. Other programs send neither.
    """

    def __init__(
        self,
        hosts: Collection[str] = LOCAL_NAMES,
        token: str | None = None,
        rate: float = DEFAULT_RATE,
        time: Callable[[], float] = monotonic,
    ) -> None:
        """Guard a server with names, a token that requests must carry, or both.

        Args:
            hosts: names under which it is asked, without port; none for any, with a token.
            token: None for none.
            rate: requests of one address in a second.
            time: in seconds.
        """
        if not hosts and not token:
            raise ValueError(
                "server must have names or a token, got neither. Give a token for other addresses."
            )
        self._hosts = frozenset(host.lower() for host in hosts)
        self._token = token
        self._rate = rate
        self._time = time
        self._clients: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def check(self, client: str, path: str, headers: Mapping[str, str]) -> None:
        """Raise `Refused` unless a request of an address may be answered.

        Headers are by name in lower case; of one that is sent twice, the values with a comma.
        """
        self._check_rate(client)
        host = headers.get("host", "")
        name = host.lower() if host.endswith("]") else host.rpartition(":")[0].lower() or host
        if self._hosts and name.lower() not in self._hosts:
            got, served = shorten_text(host, 100), min(self._hosts)
            line = f"Host must be a name of this server, got {got!r}. Ask it as {served}."
            raise Refused(403, line)
        origin = headers.get("origin")
        if origin is not None and origin.lower() not in (f"http://{host}", f"https://{host}"):
            line = f"Origin must be this server's own, got {shorten_text(origin, 100)!r}."
            raise Refused(403, f"{line} Pages of others are not answered.")
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            raise Refused(
                403, "Sec-Fetch-Site must be same-origin or none. Pages of others are not answered."
            )
        if self._token is not None and path not in OPEN_PATHS:
            given = headers.get("authorization", "")
            if not hmac.compare_digest(given.encode(), f"Bearer {self._token}".encode()):
                raise Refused(
                    401,
                    "Authorization must be Bearer and the token of this server. Send both.",
                    {"www-authenticate": "Bearer"},
                )

    def _check_rate(self, client: str) -> None:
        """Take one of the requests that an address has left; they come back with time."""
        now, most = self._time(), self._rate * _BURST_SECONDS
        left, since = self._clients.pop(client, (most, now))
        left = min(left + (now - since) * self._rate, most)
        self._clients[client] = (max(left - 1, 0.0), now)
        if len(self._clients) > MOST_CLIENTS:
            self._clients.popitem(last=False)
        if left < 1:
            raise Refused(
                429, f"requests must be at most {self._rate:g} a second, got more. Wait a second."
            )


def is_local(host: str) -> bool:
    """Tell whether an address is reached from this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
