#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""polyhull-silhouette --rig on a picture: what lies outside of the bounds as the camera sees them is background."""
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib

TOOL = sys.argv[1]
SIZE = 128
# 1 unit of the world is 32 pixels at the origin, which is in the picture's middle.
RIG = {"format": "polyhull-rig", "version": 1, "bounds": {"min": [-1, -1, -.01], "max": [0, 1, .01]},
       "cameras": [{"name": "front", "width": SIZE, "height": SIZE, "K": [[128, 0, 64], [0, 128, 64], [0, 0, 1]],
                    "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "t": [0, 0, 4]}]}


def run(*arguments, fails=False):
    result = subprocess.run([TOOL, *arguments], capture_output=True, text=True)
    assert (result.returncode != 0) == fails, (arguments, result.stdout, result.stderr)
    return result.stderr if fails else result.stdout


def write_picture(path):
    """Two red squares before a green screen, left and right of the middle."""
    red = {(x, y) for y in range(54, 74) for x in [*range(40, 54), *range(74, 88)]}
    rows = b"".join(b"\0" + b"".join(b"\xc8\x28\x28" if (x, y) in red else b"\x1e\xbe\x3c" for x in range(SIZE))
                    for y in range(SIZE))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", SIZE, SIZE, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def rings(*arguments):
    return json.loads(run(*arguments, "-o", "-"))["rings"]


with tempfile.TemporaryDirectory() as folder:
    picture, rig = os.path.join(folder, "picture.png"), os.path.join(folder, "rig.json")
    write_picture(picture)
    with open(rig, "w") as file:
        json.dump(RIG, file)
    assert len(rings(picture)) == 2
    limited = rings(picture, "--rig", rig, "--camera", "front")
    assert len(limited) == 1 and max(x for x, _ in limited[0]) < 64, limited
    assert "front" in run(picture, "--rig", rig, "--camera", "back", fails=True)
    assert "--camera" in run(picture, "--rig", rig, fails=True)
