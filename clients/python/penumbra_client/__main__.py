"""python3 -m penumbra_client SCENE.json -o MASK: one mask from a service.

Exit codes as those of `penumbra`: 0 done, 1 the work failed, 2 wrong usage or input.
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import List, Optional

from .client import Client
from .errors import BadRequest, PenumbraError, TooLarge, Unauthorized, Unprocessable
from .scene_files import load_scene_file

FORMATS = {".exr": "exr", ".png": "png", ".pfm": "pfm", ".tif": "tiff", ".tiff": "tiff"}


def main(arguments: Optional[List[str]] = None) -> int:
    parser = argparse.ArgumentParser(prog="penumbra_client", description="One mask of a scene file, from a penumbra service.",
                                     epilog="A service that asks for a token gets the one in PENUMBRA_SERVER_TOKEN.")
    parser.add_argument("scene", metavar="SCENE.json")
    parser.add_argument("-o", "--output", metavar="MASK", required=True, help="its extension is the format: .exr .tif .png .pfm")
    parser.add_argument("--server", metavar="URL", default="http://127.0.0.1:8080", help="default: %(default)s")
    parser.add_argument("--timeout", metavar="SECONDS", type=float, default=60.0, help="for one whole attempt; default: %(default)s")
    parser.add_argument("--light", metavar="NAME", help="of several lights this one; without it all together")
    parser.add_argument("--frame", metavar="N", type=int, help="of a sequence this frame, from 1")
    options = parser.parse_args(arguments)

    try:
        format = FORMATS.get(os.path.splitext(options.output)[1].lower())
        if format is None:
            raise ValueError(f"-o {options.output}: expected one of the extensions {' '.join(FORMATS)}")
        if not os.path.isdir(os.path.dirname(options.output) or "."):
            raise ValueError(f"-o {options.output}: the folder {os.path.dirname(options.output)} is not there")
        client = Client(options.server, os.environ.get("PENUMBRA_SERVER_TOKEN"), timeout=options.timeout)
        scene, images = load_scene_file(options.scene)
    except (OSError, ValueError) as error:
        return _fail(error, 2)
    try:
        mask = client.mask(scene, images, format=format, light_name=options.light, frame=options.frame)
        for warning in mask.warnings:
            print(f"penumbra_client: warning: {warning}", file=sys.stderr)
        mask.save(options.output)
    except (BadRequest, TooLarge, Unauthorized, Unprocessable, ValueError) as error:
        return _fail(error, 2)
    except (PenumbraError, OSError) as error:
        return _fail(error, 1)
    return 0


def _fail(error: Exception, code: int) -> int:
    print(f"penumbra_client: {' '.join(str(error).split())}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
