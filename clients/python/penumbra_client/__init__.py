"""Soft-shadow masks from a penumbra service.

    from penumbra_client import Client

    client = Client("http://127.0.0.1:8080")
    mask = client.mask(scene, {"front.exr": front, "floor.exr": "floor.exr"})   # arrays or files
    mask.pixels                                                                 # float32, (height, width): 1 fully lit, 0 umbra

    kept = client.keep(scene, images)                                           # uploaded once
    for half in (0.1, 0.2, 0.5):
        kept.mask(light={"half_u": [half, 0, 0], "half_v": [0, 0, -half]})

Standard library only. With numpy, pixels are numpy arrays.
"""

from .client import Client, KeptScene, Mask
from .errors import (BadRequest, ConnectionFailed, DeadlineExceeded, NotFound, Overloaded, PenumbraError, ServerError, TooLarge,
                     Unauthorized, Unprocessable)
from .scene_files import load_scene_file

__version__ = "0.1.0"
__all__ = ["BadRequest", "Client", "ConnectionFailed", "DeadlineExceeded", "KeptScene", "Mask", "NotFound", "Overloaded", "PenumbraError",
           "ServerError", "TooLarge", "Unauthorized", "Unprocessable", "load_scene_file"]
