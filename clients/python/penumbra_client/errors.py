"""What can go wrong between a client and the service: one tree of exceptions.

Arguments that are wrong before anything is sent are ValueError, TypeError or OSError, as everywhere in Python.
"""

from __future__ import annotations

from typing import Optional


class PenumbraError(Exception):
    """The service refused, failed, or could not be asked.

    status      HTTP status; None when there was no answer
    detail      what went wrong, where, and what was expected
    reason      one word, the service's or the client's own ("connect", "timeout", "broken_answer")
    path        of the value in the scene that it is about ("light.half_u"); "" when it is about none
    request_id  the request's name in the service's log; "" when there was no answer
    """

    def __init__(self, detail: str, *, status: Optional[int] = None, reason: str = "", path: str = "",
                 request_id: str = "") -> None:
        super().__init__(detail if status is None else f"{status}: {detail}")
        self.detail = detail
        self.status = status
        self.reason = reason
        self.path = path
        self.request_id = request_id


class BadRequest(PenumbraError):
    """A request that is wrong in itself: any 4xx that has no class of its own."""


class NotFound(BadRequest):
    """404: no such path, or a kept scene that the service no longer has (reason "no_scene")."""


class Unauthorized(PenumbraError):
    """401: no token, or another."""


class TooLarge(PenumbraError):
    """413: over one of the service's limits."""


class Unprocessable(PenumbraError):
    """422: a scene or image that cannot be used; `detail` names the key."""


class Overloaded(PenumbraError):
    """503: starting, full, or the device failed; still so after all retries.

    retry_after  seconds that the service asked to wait; None when it did not say
    """

    retry_after: Optional[float] = None


class DeadlineExceeded(PenumbraError):
    """504 or 408 of the service, or the client's own timeout (status None, reason "timeout")."""


class ServerError(PenumbraError):
    """Any other status from 500, and answers that are not what was asked for (reason "broken_answer")."""


class ConnectionFailed(PenumbraError):
    """No connection, or it broke before the whole answer was there."""


def class_for(status: int) -> type[PenumbraError]:
    """The exception class of an HTTP status that is not a success."""
    known = {401: Unauthorized, 404: NotFound, 408: DeadlineExceeded, 413: TooLarge, 422: Unprocessable,
             503: Overloaded, 504: DeadlineExceeded}
    return known.get(status, BadRequest if 400 <= status < 500 else ServerError)
