#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sends what a renderer would say of its frames beside its video: a camera on a circle around the middle
of the built-in room and a lamp that goes to and fro over it, or the lines of a file, as JSON over UDP.

    pipelines/send-scene.py --seconds 10 &
    gst-launch-1.0 udpsrc port=40010 ! fakesink dump=true
"""
import argparse
import json
import math
import socket
import time


def viewport(width, height, degrees, radius, eye_height):
    """A camera at the angle on the circle, metres and y up, that looks at the height of the chest. R and t
    lead from the scene to the camera: x right, y down, z forward; pixel (0, 0) is the middle of one."""
    angle = math.radians(degrees)
    eye = (radius * math.sin(angle), eye_height, radius * math.cos(angle))
    length = math.hypot(radius, eye_height - 1)
    forward = (-eye[0] / length, (1 - eye_height) / length, -eye[2] / length)
    right = (math.cos(angle), 0.0, -math.sin(angle))
    down = (forward[1] * right[2] - forward[2] * right[1], forward[2] * right[0] - forward[0] * right[2],
            forward[0] * right[1] - forward[1] * right[0])
    rows = (right, down, forward)
    focal_length = 0.5 * height / math.tan(math.radians(52 / 2))
    return {"name": "viewport", "width": width, "height": height,
            "K": [focal_length, 0, (width - 1) / 2, 0, focal_length, (height - 1) / 2, 0, 0, 1],
            "R": [value for row in rows for value in row],
            "t": [-sum(a * b for a, b in zip(row, eye)) for row in rows]}


def example(options):
    """An announcement for each frame, as docs/formats.md has it."""
    for count in range(round(options.seconds * options.rate)):
        seconds = count / options.rate
        whole, frame = divmod(count, options.rate)
        yield {"format": "polyhull-announcement", "version": 1,
               "viewport": viewport(options.width, options.height, options.speed * seconds, 2.7, 1.5),
               "scene": options.scene,
               # A parallelogram centre ± u ± v that shines to the side of u × v: downwards.
               "lights": [{"name": "lamp", "centre": [0.8 * math.sin(seconds), 2.5, 0.5], "u": [0.3, 0, 0],
                           "v": [0, 0, 0.3], "radiance": [30, 30, 28], "mesh": -1}],
               "exposure": 0.5, "ambient": [0.2, 0.2, 0.2],
               "timecode": f"{whole // 3600 % 24:02}:{whole // 60 % 60:02}:{whole % 60:02}:{frame:02}",
               "timecode_rate": [options.rate, 1],
               "stream_time_ns": count * 1_000_000_000 // options.rate}


def recorded(path):
    with open(path) as lines:
        for line in lines:
            if line.strip():
                yield json.loads(line)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--to", default="127.0.0.1", help="address or multicast group")
    parser.add_argument("--port", type=int, default=40010)
    parser.add_argument("--file", help="lines that are sent in the example's place, each at its "
                                       "stream_time_ns, as render_scene.py writes them")
    parser.add_argument("--scene", default="builtin:room", help="the glTF file that composite opens")
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=360)
    parser.add_argument("--rate", type=int, default=25, help="frames per second")
    parser.add_argument("--seconds", type=float, default=60, help="how long it sends")
    parser.add_argument("--speed", type=float, default=10, help="degrees per second on the circle")
    options = parser.parse_args()

    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    begin, begin_unix = time.monotonic(), time.time_ns()
    for said in recorded(options.file) if options.file else example(options):
        due = said["stream_time_ns"]
        time.sleep(max(0, begin + due / 1e9 - time.monotonic()))
        # When a camera would have taken the frame, for those that share a clock.
        said.setdefault("unix_time_ns", begin_unix + due)
        sender.sendto((json.dumps(said) + "\n").encode(), (options.to, options.port))


if __name__ == "__main__":
    main()
