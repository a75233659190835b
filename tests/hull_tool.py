#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""polyhull-hull on a scene file and on masks: what it prints and writes is a box of known volume."""
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib

TOOL = sys.argv[1]


def run(*arguments, fails=False):
    result = subprocess.run([TOOL, *arguments], capture_output=True, text=True)
    assert (result.returncode != 0) == fails, (arguments, result.stdout, result.stderr)
    return result.stderr if fails else result.stdout


def said(*arguments):
    """What a run that succeeds writes beside its output."""
    result = subprocess.run([TOOL, *arguments], capture_output=True, text=True)
    assert result.returncode == 0, (arguments, result.stderr)
    return result.stderr


def camera(name, rotation, centre):
    t = [-sum(row[k] * centre[k] for k in range(3)) for row in rotation]
    return {"name": name, "width": 1024, "height": 768, "K": [[1024, 0, 512], [0, 1024, 384], [0, 0, 1]],
            "R": rotation, "t": t}


# Looking along z and along x from 4 units away, y down in both.
CAMERAS = [camera("front", [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, -4]),
           camera("side", [[0, 0, -1], [0, 1, 0], [1, 0, 0]], [-4, 0, 0])]
RIG = {"format": "polyhull-rig", "version": 1, "cameras": CAMERAS,
       "bounds": {"min": [-3, -3, -3], "max": [3, 3, 3]}}
SQUARE = [[256.0, 128.0], [256.0, 640.0], [768.0, 640.0], [768.0, 128.0]]  # |x|, |y| <= depth / 4


def expected_volume():
    """|x|, |y| <= (z + 4) / 4 and |z|, |y| <= (x + 4) / 4, by adding up thin slices in y."""
    # For a y, both depths are at least 4 |y|: x, z >= 4 |y| - 4; |x| <= (z + 4) / 4, |z| <= (x + 4) / 4.
    steps, total = 400, 0.0
    for i in range(steps):
        y = (i + 0.5) / steps * 4 / 3
        low = 4 * y - 4
        polygon = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)]
        for a, b, c in [(1, 0, -low), (0, 1, -low), (-1, .25, 1), (1, .25, 1), (.25, -1, 1), (.25, 1, 1)]:
            out = []
            for p, q in zip(polygon, polygon[1:] + polygon[:1]):
                f, g = a * p[0] + b * p[1] + c, a * q[0] + b * q[1] + c
                if f >= 0:
                    out.append(p)
                if (f >= 0) != (g >= 0):
                    out.append(tuple(u + (v - u) * f / (f - g) for u, v in zip(p, q)))
            polygon = out
            if not polygon:
                break
        total += sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(polygon, polygon[1:] + polygon[:1])) / 2
    return 2 * total * (4 / 3) / steps


def write_mask(path, left, top, right, bottom):
    rows = b""
    for y in range(768):
        inside = top <= y < bottom
        rows += b"\0" + bytes(255 if inside and left <= x < right else 0 for x in range(1024))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 1024, 768, 8, 0, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def read_ply(path):
    with open(path, "rb") as file:
        data = file.read()
    header, body = data.split(b"end_header\n", 1)
    assert b"format binary_little_endian" in header and b"property double x" in header, header
    count = int(header.split(b"element vertex ")[1].split()[0])
    return count, len(body)


def main():
    with tempfile.TemporaryDirectory() as folder:
        scene = os.path.join(folder, "scene.json")
        with open(scene, "w") as file:
            json.dump({"name": "box", "rig": RIG, "silhouettes": [[SQUARE], [SQUARE]]}, file)
        report = json.loads(run(scene, "--json", "--repeat", "3", "--threads", "2"))
        want = expected_volume()
        assert report["closed"] and abs(report["volume"] / want - 1) < 1e-4, (report, want)
        assert report["cameras"] == 2 and report["contour_vertices"] == 8 and report["median_ms"] > 0, report
        assert set(report["phases_ms"]) == {"prepare", "scene", "faces", "assemble",
                                            "triangulate"}, report
        assert 0 <= report["exact_predicate_share"] <= 1, report
        assert "closed" in run(scene)

        small = json.loads(run(scene, "--json", "--bounds", "-.1,-.1,-.1,.1,.1,.1"))
        assert abs(small["volume"] / 0.008 - 1) < 1e-6, small
        free = json.loads(run(scene, "--json", "--bounds", "none"))
        assert abs(free["volume"] / want - 1) < 1e-4, free
        kept = json.loads(run(scene, "--json", "--unseen", "keep"))
        assert kept["volume"] >= report["volume"], kept

        for ending in ("ply", "glb", "obj"):
            path = os.path.join(folder, "hull." + ending)
            run(scene, "-o", path)
            assert os.path.getsize(path) > 100, path
        count, size = read_ply(os.path.join(folder, "hull.ply"))
        assert count == report["vertices"] and size > 24 * count, (count, report)
        with open(os.path.join(folder, "hull.obj")) as file:
            assert sum(line.startswith("v ") for line in file) == report["vertices"]

        rig = os.path.join(folder, "rig.json")
        with open(rig, "w") as file:
            json.dump(RIG, file)
        masks = [os.path.join(folder, name + ".png") for name in ("a", "b")]
        for mask in masks:
            write_mask(mask, 256, 128, 768, 640)
        by_name = ["--rig", rig, "--mask", "front=" + masks[0], "--mask", "side=" + masks[1]]
        traced = json.loads(run(*by_name, "--json"))
        assert traced["closed"] and abs(traced["volume"] / want - 1) < 0.02, (traced, want)
        assert json.loads(run("--rig", rig, "--mask", masks[0], "--mask", masks[1], "--json"))["volume"] == \
            traced["volume"]

        # Files that begin with a camera's name, in another order than the rig's: a wide and a narrow one.
        named = [os.path.join(folder, name) for name in ("side-0001.png", "front-0001.png")]
        write_mask(named[0], 256, 128, 768, 640)
        write_mask(named[1], 384, 128, 640, 640)
        hulls = [os.path.join(folder, name) for name in ("named.obj", "told.obj")]
        run("--rig", rig, "--mask", named[0], "--mask", named[1], "-o", hulls[0])
        run("--rig", rig, "--mask", "front=" + named[1], "--mask", "side=" + named[0], "-o", hulls[1])
        vertices = [[line for line in open(path) if line.startswith("v ")] for path in hulls]
        assert vertices[0] and vertices[0] == vertices[1]
        assert "already" in run("--rig", rig, "--mask", named[0], "--mask", "side=" + masks[1], fails=True)

        # Masks of one name lie in folders named after the cameras; what goes by order is said, and a file
        # that serves two cameras.
        for name, left in (("side", 256), ("front", 384)):
            os.mkdir(os.path.join(folder, name))
            write_mask(os.path.join(folder, name, "mask.png"), left, 128, 1024 - left, 640)
        same = ["--mask", os.path.join(folder, "side", "mask.png"), "--mask", os.path.join(folder, "front", "mask.png")]
        run("--rig", rig, *same, "-o", hulls[0])
        assert [line for line in open(hulls[0]) if line.startswith("v ")] == vertices[1]
        assert said("--rig", rig, *same) == ""
        told = said("--rig", rig, "--mask", masks[1], "--mask", masks[0])
        assert "order: front=" + masks[1] + ", side=" + masks[0] in told, told
        told = said("--rig", rig, "--mask", "front=" + masks[1], "--mask", "side=" + masks[1])
        assert masks[1] + ' is the picture of both "front" and "side"' in told, told

        # A name goes before the order, and cam10 is not cam1.
        other = os.path.join(folder, "sidelong.png")
        write_mask(other, 256, 128, 768, 640)
        run("--rig", rig, "--mask", other, "--mask", named[0], "--mask", named[1], fails=True)
        run("--rig", rig, "--mask", other, "--mask", named[0])
        assert "--bounds" in run("--rig", rig, "--mask", named[0], "--bounds", "0,0,0,1,1,1,7", fails=True)
        assert "nobody" in run("--rig", rig, "--mask", "nobody=" + masks[0], fails=True)
        assert "more files" in run("--rig", rig, *(["--mask", masks[0]] * 3), fails=True)
        run("--rig", rig, "--mask", "front=" + rig, fails=True)
        run(fails=True)
        run("/nowhere.json", fails=True)
        run(rig, fails=True)
        assert "expected" in run(scene, "--bounds", "1,2", fails=True)
        assert ".ply" in run(scene, "-o", os.path.join(folder, "hull.unknown"), fails=True)
    print("ok")


main()
