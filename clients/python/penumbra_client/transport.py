"""Requests over http.client: one connection each (the service closes it), a deadline for the whole exchange, and retries."""

from __future__ import annotations

import email.utils
import http.client
import io
import json
import random
import secrets
import socket
import ssl
import urllib.parse
from time import monotonic, sleep, time
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from .errors import ConnectionFailed, DeadlineExceeded, Overloaded, PenumbraError, ServerError, class_for

BACKOFF_S = 0.25     # before the first retry; doubles with each
MAX_BACKOFF_S = 8.0
MAX_RETRY_AFTER_S = 60.0  # a service that asks for more is not waited for

Body = Tuple[bytes, str]  # and its media type


class Answer(NamedTuple):
    status: int
    headers: "http.client.HTTPMessage"
    body: bytes

    def header(self, name: str) -> str:
        return self.headers.get(name, "")


def form(parts: Sequence[Tuple[str, bytes]]) -> Body:
    """multipart/form-data. The boundary is random and in no part."""
    while True:
        boundary = secrets.token_hex(16)
        if not any(boundary.encode() in data for _, data in parts):
            break
    pieces: List[bytes] = []
    for name, data in parts:
        pieces += [f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"; filename="{name}"\r\n\r\n'.encode(), data, b"\r\n"]
    pieces.append(f"--{boundary}--\r\n".encode())
    return b"".join(pieces), f"multipart/form-data; boundary={boundary}"


class _Reader(io.RawIOBase):
    """A socket's bytes until a point in time, however slowly they come."""

    def __init__(self, connection: socket.socket, end: float) -> None:
        self._connection = connection
        self._file = connection.makefile("rb", buffering=0)  # http.client closes the socket before it reads the body; this keeps it open
        self._end = end

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> Optional[int]:
        left = self._end - monotonic()
        if left <= 0:
            raise socket.timeout("timed out")
        self._connection.settimeout(left)
        return self._file.readinto(buffer)

    def close(self) -> None:
        self._file.close()
        super().close()


class _Source:
    """What http.client.HTTPResponse asks of a socket."""

    def __init__(self, connection: socket.socket, end: float) -> None:
        self._connection = connection
        self._end = end

    def makefile(self, _mode: str) -> io.BufferedReader:
        return io.BufferedReader(_Reader(self._connection, self._end), 1 << 16)


class Transport:
    """Where the service is, and how patiently it is asked."""

    def __init__(self, url: str, token: Optional[str], timeout: float, retries: int, context: Optional[ssl.SSLContext]) -> None:
        address = urllib.parse.urlsplit(url)
        if address.scheme not in ("http", "https") or not address.hostname or address.query or address.fragment or address.username:
            raise ValueError(f"url {url!r}: expected http://HOST[:PORT][/PATH] or https://...")
        if not timeout > 0 or timeout > 1e6:
            raise ValueError(f"timeout {timeout!r}: expected seconds, above 0 and at most 1e6")
        if retries < 0:
            raise ValueError(f"retries {retries!r}: expected 0 or more")
        self.url = url.rstrip("/")
        self._host: str = address.hostname
        self._port = address.port
        self._path = address.path.rstrip("/")
        self._secure = address.scheme == "https"
        self._context = context
        self._token = token
        self._timeout = timeout
        self._retries = retries

    def ask(self, method: str, path: str, body: Optional[Body] = None, headers: Optional[Mapping[str, str]] = None,
            accepted: Sequence[int] = (200,)) -> Answer:
        """The answer, whose status is one of `accepted`. Asks again after 503 and refused connections, and after nothing else."""
        for attempt in range(self._retries + 1):
            last = attempt == self._retries
            try:
                answer = self.once(method, path, body, dict(headers or {}))
            except ConnectionFailed as error:
                if last or error.reason != "refused":
                    raise
                sleep(_pause(attempt))
                continue
            if answer.status in accepted:
                return answer
            error = error_of(answer)
            if last or not isinstance(error, Overloaded) or (error.retry_after or 0) > MAX_RETRY_AFTER_S:
                raise error
            # Never sooner than asked; the jitter on top keeps clients apart that were refused together.
            sleep((error.retry_after or 0) + _pause(attempt))
        raise AssertionError("unreachable: the last attempt returns or raises")

    def once(self, method: str, path: str, body: Optional[Body], headers: Dict[str, str]) -> Answer:
        """One attempt; any status is an answer."""
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
        if body:
            headers["Content-Type"] = body[1]
        end = monotonic() + self._timeout
        connection = self._connect()
        try:
            connection.response_class = lambda sock, *args, **named: http.client.HTTPResponse(  # type: ignore[assignment]
                _Source(sock, end), *args, **named)  # type: ignore[arg-type]
            try:
                # A send's timeout is for all of it.
                connection.sock.settimeout(max(end - monotonic(), 1e-3))
                connection.request(method, self._path + path, body[0] if body else None, headers)
            except (BrokenPipeError, ConnectionResetError):
                pass  # an upload that is refused early: the answer says why
            response = connection.getresponse()
            return Answer(response.status, response.headers, response.read())
        except socket.timeout:
            raise DeadlineExceeded(f"{self.url}{path}: no whole answer within {self._timeout:g} s, the client's timeout",
                                   reason="timeout") from None
        except http.client.HTTPException as error:
            if isinstance(error, (http.client.IncompleteRead, http.client.RemoteDisconnected)):
                raise ConnectionFailed(f"{self.url}{path}: the connection ended before the whole answer was there", reason="ended") from error
            raise ServerError(f"{self.url}{path}: the answer is not HTTP ({type(error).__name__}: {_line(str(error))})",
                              reason="broken_answer") from error
        except OSError as error:
            raise ConnectionFailed(f"{self.url}{path}: the connection broke: {error}", reason="broke") from error
        finally:
            connection.close()

    def _connect(self) -> http.client.HTTPConnection:
        connection: http.client.HTTPConnection
        if self._secure:
            connection = http.client.HTTPSConnection(self._host, self._port, timeout=self._timeout, context=self._context)
        else:
            connection = http.client.HTTPConnection(self._host, self._port, timeout=self._timeout)
        try:
            connection.connect()
        except ConnectionRefusedError as error:
            raise ConnectionFailed(f"{self.url}: nobody listens there: {error}", reason="refused") from error
        except OSError as error:
            raise ConnectionFailed(f"{self.url}: cannot be reached: {error}", reason="connect") from error
        return connection


def error_of(answer: Answer) -> PenumbraError:
    """The exception for an answer that is no success: its problem+json, or what there is of it."""
    detail, reason, path, request_id = "", "", "", answer.header("X-Request-Id")
    try:
        problem = json.loads(answer.body)
        if isinstance(problem, dict):
            detail, reason = str(problem.get("detail", "")), str(problem.get("reason", ""))
            path, request_id = str(problem.get("path", "")), str(problem.get("request_id", request_id))
    except (ValueError, RecursionError):
        pass  # not the service itself, but something in front of it
    if not detail:
        start = _line(answer.body[:200].decode("utf-8", "replace"))
        detail = f"an answer without a problem description{': ' if start else ''}{start}"
    error = class_for(answer.status)(detail, status=answer.status, reason=reason, path=path, request_id=request_id)
    if isinstance(error, Overloaded):
        error.retry_after = _retry_after(answer.header("Retry-After"))
    return error


def _retry_after(text: str) -> Optional[float]:
    """Seconds, from a number of seconds or a date. None for neither."""
    if text.strip().isascii() and text.strip().isdigit():
        return float(text)
    try:
        return max(0.0, email.utils.parsedate_to_datetime(text).timestamp() - time())
    except (TypeError, ValueError, IndexError):
        return None


def _pause(attempt: int) -> float:
    return min(MAX_BACKOFF_S, BACKOFF_S * 2.0 ** min(attempt, 30)) * random.uniform(0.5, 1.0)


def _line(text: str) -> str:
    return " ".join(text.split())
