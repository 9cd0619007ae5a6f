"""The service's verbs."""

from __future__ import annotations

import json
import os
import ssl
import tempfile
import urllib.parse
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from .errors import NotFound, ServerError
from .images import ImageLike, Shape, decode_pfm, encode_parts
from .transport import Answer, Body, Transport, error_of, form

MEDIA_TYPES = {
    "array": "image/x-portable-floatmap",
    "pfm": "image/x-portable-floatmap",
    "exr": "image/x-exr",
    "png": "image/png",
    "tiff": "image/tiff",
}


@dataclass(frozen=True, eq=False)
class Mask:
    """Visibility of each receiver pixel: linear, 1 fully lit, 0 umbra.

    pixels      float32, shape (height, width), or (height, width, 3) under a textured light; row 0 is the top. A numpy array; without
                numpy a flat array('f') of the same order. None when a file format was asked for.
    shape       of `pixels`; () for file formats
    data        the file's bytes as the service sent them (for arrays: PFM)
    format      what was asked for: array, pfm, exr, png, tiff
    warnings    what the service assumed or left out
    timings     milliseconds by stage, in the order they ran (the Server-Timing header)
    request_id  the request's name in the service's log
    etag        of inputs, format, program and device: see `previous` of Client.mask
    """

    pixels: Any = field(repr=False)
    shape: Shape
    data: bytes = field(repr=False)
    format: str
    warnings: List[str]
    timings: Dict[str, float]
    request_id: str
    etag: str

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Writes `data` to `path`: whole or not at all. The format is what was asked for, whatever the name."""
        folder = os.path.dirname(os.path.abspath(path))
        handle, temporary = tempfile.mkstemp(dir=folder, prefix=os.path.basename(path) + ".")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(self.data)
            mask = os.umask(0)  # mkstemp makes files for this user alone; others are made as the umask says
            os.umask(mask)
            os.chmod(temporary, 0o666 & ~mask)
            os.replace(temporary, path)
        except BaseException:
            os.unlink(temporary)
            raise


class Client:
    """A penumbra service.

    url          http://HOST:PORT or https://..., with a path when a proxy has it under one
    token        what the service was given as its token; None: none
    timeout      seconds for one whole attempt, from the first byte sent to the last one received
    retries      further attempts after 503 (never sooner than Retry-After says) and after a refused connection, with pauses of 0.25 s that
                 double up to 8 s, less up to a half by chance. Nothing else is tried again.
    traceparent  W3C trace context, sent with every request; None: none
    context      TLS settings for https
    Safe to use from several threads: it holds no connection.
    """

    def __init__(self, url: str, token: Optional[str] = None, *, timeout: float = 60.0, retries: int = 4,
                 traceparent: Optional[str] = None, context: Optional[ssl.SSLContext] = None) -> None:
        self._transport = Transport(url, token, timeout, retries, context)
        self.traceparent = traceparent

    def mask(self, scene: Mapping[str, Any], images: Optional[Mapping[str, ImageLike]] = None, *, format: str = "array",
             previous: Optional[Mask] = None, traceparent: Optional[str] = None, light_name: Optional[str] = None,
             frame: Optional[int] = None, image: str = "mask") -> Mask:
        """The mask of a scene (a dict of the scene file's form, docs/scene_file.md).

        images    by the names that the scene gives them: paths or bytes of EXR, PNG, TIFF or PFM files, or float arrays
                  (numpy, nested lists, or (array('f'), shape)) of shape (height, width): depth in scene units unless the scene's
                  `encoding` says otherwise
        format    "array" for pixels, or "pfm", "exr", "png", "tiff" for a file's bytes
        previous  a mask from before: returned itself when the service says that the answer would be the same
        light_name, frame
                  of a scene with `lights` one light's mask; without a name that of all together. Of a scene with a sequence of
                  emission images that frame, from 1; needed there.
        image     "mask", or "bound": the lowest and the highest visibility that each pixel can have where depth images cast, an EXR
                  with the channels low and high; needs format="exr"
        """
        body = form([("scene", _json(scene))] + encode_parts(images))
        return self._mask("/v1/masks" + _query(light_name, frame, image, format), body, format, previous, traceparent)

    def keep(self, scene: Mapping[str, Any], images: Optional[Mapping[str, ImageLike]] = None) -> "KeptScene":
        """Uploads a scene once, for many masks under changed lights, receivers or techniques."""
        return KeptScene(self, form([("scene", _json(scene))] + encode_parts(images)))

    def techniques(self) -> List[Dict[str, Any]]:
        """Each technique: kind, summary, lights, inputs, and a JSON Schema of its keys."""
        return _member(self._get("/v1/techniques"), "techniques", list)

    def devices(self) -> Dict[str, Any]:
        """`version` of the service and its `devices`; the one that computes has `selected`."""
        return _member(self._get("/v1/devices"), None, dict)

    def ready(self) -> bool:
        """Whether the service would compute now. One question, without retries; raises when it cannot be asked."""
        answer = self._transport.once("GET", "/readyz", None, self._headers(None))
        if answer.status not in (200, 503):
            raise error_of(answer)
        return answer.status == 200

    def _get(self, path: str) -> Answer:
        return self._transport.ask("GET", path, headers=self._headers(None))

    def _headers(self, traceparent: Optional[str]) -> Dict[str, str]:
        chosen = traceparent or self.traceparent
        return {"traceparent": chosen} if chosen else {}

    def _mask(self, path: str, body: Body, format: str, previous: Optional[Mask], traceparent: Optional[str]) -> Mask:
        if format not in MEDIA_TYPES:
            raise ValueError(f"format {format!r}: expected one of {', '.join(MEDIA_TYPES)}")
        headers = self._headers(traceparent)
        headers["Accept"] = MEDIA_TYPES[format]
        if previous is not None and previous.etag and previous.format == format:
            headers["If-None-Match"] = previous.etag
        answer = self._transport.ask("POST", path, body, headers, (200, 304) if "If-None-Match" in headers else (200,))
        if answer.status == 304:
            assert previous is not None
            return previous
        return _mask_from(answer, format)


class KeptScene:
    """A scene that the service keeps for a time, renewed by each use. When it was forgotten it is uploaded again by itself.

    id          names its content: the same upload has the same id
    expires_s   seconds without use after which it is forgotten
    size_bytes  that it takes in the service
    warnings    about the upload
    """

    id: str
    expires_s: float
    size_bytes: int
    warnings: List[str]

    def __init__(self, client: Client, upload: Body) -> None:
        self._client = client
        self._upload = upload
        self._send()

    def mask(self, *, light: Optional[Mapping[str, Any]] = None, lights: Optional[Sequence[Mapping[str, Any]]] = None,
             receivers: Optional[Mapping[str, Any]] = None, technique: Optional[Mapping[str, Any]] = None,
             output: Optional[Mapping[str, Any]] = None, images: Optional[Mapping[str, ImageLike]] = None, format: str = "array",
             previous: Optional[Mask] = None, traceparent: Optional[str] = None, light_name: Optional[str] = None,
             frame: Optional[int] = None, image: str = "mask") -> Mask:
        """The mask of the kept scene with these sections changed, for this request only.

        Each section is merged into the kept one (JSON Merge Patch: keys replace, None removes a key); one with another `kind` replaces it,
        and the list `lights` is replaced whole. `images` add to the kept ones or replace them; the rest is as in Client.mask.
        """
        given = {"light": light, "lights": lights, "receivers": receivers, "technique": technique, "output": output}
        patch = _json({key: value for key, value in given.items() if value is not None})
        body: Body = form([("scene", patch)] + encode_parts(images)) if images else (patch, "application/merge-patch+json")
        query = _query(light_name, frame, image, format)
        try:
            return self._client._mask(f"/v1/scenes/{self.id}/masks{query}", body, format, previous, traceparent)
        except NotFound as error:
            if error.reason != "no_scene":
                raise
        self._send()
        return self._client._mask(f"/v1/scenes/{self.id}/masks{query}", body, format, previous, traceparent)

    def forget(self) -> None:
        """Tells the service that it is needed no more. Not an error when it was forgotten already."""
        self._client._transport.ask("DELETE", f"/v1/scenes/{self.id}", headers=self._client._headers(None), accepted=(200, 204, 404))

    def __enter__(self) -> "KeptScene":
        return self

    def __exit__(self, *_: object) -> None:
        self.forget()

    def _send(self) -> None:
        answer = self._client._transport.ask("POST", "/v1/scenes", self._upload, self._client._headers(None), (200, 201))
        kept = _member(answer, None, dict)
        scene_id = kept.get("id")
        # It becomes part of a path.
        if not isinstance(scene_id, str) or not scene_id.isalnum() or not scene_id.isascii():
            raise _broken(answer, f"the id of the kept scene is {scene_id!r}")
        self.id = scene_id
        self.expires_s = float(kept.get("expires_s", 0))
        self.size_bytes = int(kept.get("bytes", 0))
        self.warnings = [str(warning) for warning in kept.get("warnings", [])]


def _query(light_name: Optional[str], frame: Optional[int], image: str, format: str) -> str:
    if image not in ("mask", "bound"):
        raise ValueError(f"image {image!r}: expected mask or bound")
    if image == "bound" and format != "exr":
        raise ValueError(f"image 'bound' has two named channels, expected format 'exr', not {format!r}")
    given = {"light": light_name, "frame": frame, "image": image if image != "mask" else None}
    if frame is not None and (isinstance(frame, bool) or not isinstance(frame, int) or frame < 1):
        raise ValueError(f"frame is {frame!r}, expected a number from 1")
    query = urllib.parse.urlencode({key: value for key, value in given.items() if value is not None})
    return "?" + query if query else ""


def _json(value: Mapping[str, Any]) -> bytes:
    if not isinstance(value, Mapping):
        raise TypeError(f"the scene is {type(value).__name__}, expected a dict")
    # numpy's numbers and arrays have tolist().
    return json.dumps(dict(value), allow_nan=False, default=_plain).encode()


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"the scene has a {type(value).__name__}, which JSON cannot hold")


def _broken(answer: Answer, what: str) -> ServerError:
    return ServerError(f"the answer cannot be used: {what}", status=answer.status, reason="broken_answer",
                       request_id=answer.header("X-Request-Id"))


def _member(answer: Answer, key: Optional[str], kind: type) -> Any:
    try:
        document = json.loads(answer.body)
    except (ValueError, RecursionError):
        raise _broken(answer, "expected JSON") from None
    value = document if key is None else document.get(key) if isinstance(document, dict) else None
    if not isinstance(value, kind):
        raise _broken(answer, f"expected a JSON {kind.__name__}{'' if key is None else ' named ' + key}")
    return value


def _mask_from(answer: Answer, format: str) -> Mask:
    media_type = answer.header("Content-Type").split(";")[0].strip().lower()
    if media_type != MEDIA_TYPES[format]:
        raise _broken(answer, f"it is {media_type or 'of no type'}, expected {MEDIA_TYPES[format]}")
    pixels, shape = None, ()
    if format == "array":
        try:
            pixels, shape = decode_pfm(answer.body)
        except ValueError as error:
            raise _broken(answer, f"the mask {error}") from None
    return Mask(pixels=pixels, shape=shape, data=answer.body, format=format, warnings=_warnings(answer),
                timings=dict(_timings(answer.header("Server-Timing"))), request_id=answer.header("X-Request-Id"), etag=answer.header("ETag"))


def _warnings(answer: Answer) -> List[str]:
    text = answer.header("Penumbra-Warnings")
    if not text:
        return []
    try:
        warnings = json.loads(text)
    except (ValueError, RecursionError):
        warnings = None
    if not isinstance(warnings, list):
        raise _broken(answer, "Penumbra-Warnings is not a JSON array")
    return [str(warning) for warning in warnings]


def _timings(text: str) -> Sequence[Tuple[str, float]]:
    """Stages of a Server-Timing header that have a duration; others (a proxy may add its own) are not ours."""
    stages = []
    for entry in text.split(","):
        name, *parameters = (piece.strip() for piece in entry.split(";"))
        for parameter in parameters:
            key, _, value = parameter.partition("=")
            try:
                if key.strip().lower() == "dur":
                    stages.append((name, float(value.strip().strip('"'))))
            except ValueError:
                pass
    return stages
