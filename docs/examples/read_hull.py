#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Takes hulls out of the chain with an appsink and reads them without the core library: vertices, triangles,
and what each camera saw. Needs Debian's python3-gi, python3-flatbuffers and flatbuffers-compiler.

    flatc --python -o readers view.fbs mesh.fbs     # both: a mesh holds views
    PYTHONPATH=readers python3 read_hull.py
"""
import struct
import sys

import gi

gi.require_version("Gst", "1.0")
from gi.repository import Gst  # noqa: E402
from polyhull.wire.Mesh import Mesh  # noqa: E402
from polyhull.wire.PixelFormat import PixelFormat  # noqa: E402

HEADER = struct.Struct("<4sIIIQQ")  # magic, version, where pixels begin, FlatBuffer's size, pixels' size, zero


def read_mesh(payload):
    """The mesh's table and, view by view, its pixels, from the bytes of one buffer."""
    magic, version, pixels, _size, _pixels_size, _ = HEADER.unpack_from(payload)
    if magic != b"PHMS" or version != 1:
        raise ValueError(f"these are no bytes of a mesh in format 1, but {magic} in format {version}")
    mesh = Mesh.GetRootAs(payload, HEADER.size)
    blocks = []
    for i in range(mesh.ViewsLength()):
        size = mesh.Views(i).View().PixelsSize()
        blocks.append(payload[pixels:pixels + size])
        pixels += size
    return mesh, blocks


def vertices_of(hull):
    """[(x, y, z)] in the rig's world. (With numpy: hull.VerticesAsNumpy().reshape(-1, 3).)"""
    origin = [hull.Origin(k) for k in range(3)]
    return [tuple(origin[k] + hull.Vertices(i + k) for k in range(3))
            for i in range(0, hull.VerticesLength(), 3)]


def triangles_of(hull):
    """[(a, b, c)], indices of vertices, counter-clockwise seen from outside."""
    return [tuple(hull.Triangles(i + k) for k in range(3)) for i in range(0, hull.TrianglesLength(), 3)]


def is_closed(triangles):
    edges = {(t[k], t[(k + 1) % 3]) for t in triangles for k in range(3)}
    return all((b, a) in edges for a, b in edges)


def volume(vertices, triangles):
    total = 0.0
    for triangle in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (vertices[i] for i in triangle)
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6.0


def describe(payload):
    mesh, blocks = read_mesh(payload)
    vertices, triangles = vertices_of(mesh.Hull()), triangles_of(mesh.Hull())
    print(f"{len(vertices)} vertices, {len(triangles)} triangles, "
          f"{'closed' if is_closed(triangles) else 'open'}, {volume(vertices, triangles):.4f} m3")
    for i, pixels in enumerate(blocks):
        view = mesh.Views(i).View()
        line = (f"  {view.Camera().decode()}: {view.Width()}x{view.Height()}, {view.EndsLength()} contours of "
                f"{view.PointsLength() // 2} points")
        if view.Format() == PixelFormat.rgba and pixels:  # row by row, Stride() bytes apart, alpha the matte
            x, y = view.RoiWidth() // 2, view.RoiHeight() // 2
            at = y * view.Stride() + 4 * x
            line += f", RGBA {tuple(pixels[at:at + 4])} at ({view.RoiX() + x}, {view.RoiY() + y})"
        print(line)


def main():
    Gst.init(None)
    cameras = " ".join(f"rigtestsrc camera=cam{i} num-buffers=2 ! silhouette camera=cam{i} ! hull."
                       for i in range(4))
    pipeline = Gst.parse_launch(f"{cameras} hullbuild name=hull ! appsink name=meshes sync=false")
    meshes = pipeline.get_by_name("meshes")
    pipeline.set_state(Gst.State.PLAYING)
    count = 0
    while sample := meshes.emit("pull-sample"):  # None at the end of the stream, or after an error
        buffer = sample.get_buffer()
        describe(buffer.extract_dup(0, buffer.get_size()))
        count += 1
    message = pipeline.get_bus().pop_filtered(Gst.MessageType.ERROR)
    if message:
        print(message.parse_error()[0].message, file=sys.stderr)
    pipeline.set_state(Gst.State.NULL)
    return 0 if count > 0 and not message else 1


if __name__ == "__main__":
    sys.exit(main())
