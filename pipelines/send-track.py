#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Sends what a camera tracker would: a camera that travels around the middle of a room on a circle and
looks at it, as FreeD's or OpenTrackIO's packets over UDP.

    pipelines/send-track.py --seconds 10 &
    gst-launch-1.0 tracksrc port=40000 ! fakesink dump=true
"""
import argparse
import json
import math
import random
import socket
import struct
import time


def fletcher16(data):
    low = high = 0
    for byte in data:
        low = (low + byte) % 255
        high = (high + low) % 255
    return high << 8 | low


def freed(camera, pan, tilt, place, zoom, focus):
    """A packet D1: degrees, metres, encoders' values; pan grows to the right."""
    steps = [round(angle * 32768) for angle in (pan, tilt, 0)] + [round(v * 64000) for v in place]
    steps += [round(zoom), focus]
    packet = bytes([0xD1, camera]) + b"".join(struct.pack(">i", s)[1:] for s in steps) + bytes(2)
    return packet + bytes([(0x40 - sum(packet)) & 0xFF])


def timecode(seconds, rate):
    """From 00:00:00:00 on, as timecodestamper's."""
    frame = int(seconds * rate + 1e-6)
    return {"hours": frame // rate // 3600 % 24, "minutes": frame // rate // 60 % 60,
            "seconds": frame // rate % 60, "frames": frame % rate,
            "frameRate": {"num": rate, "denom": 1}}


def opentrackio(number, pan, tilt, place, sequence, taken, code):
    """A packet with a header: degrees, metres, seconds; pan grows to the left."""
    x, y, z = place
    sample = {
        "protocol": {"name": "OpenTrackIO", "version": [1, 0, 1]},
        "sourceId": f"urn:uuid:00000000-0000-4000-8000-{number:012}", "sourceNumber": number,
        "timing": {"sequenceNumber": sequence, "sampleTimestamp": {
            "seconds": int(taken), "nanoseconds": int(taken % 1 * 1e9)}},
        "static": {"camera": {"activeSensorPhysicalDimensions": {"width": 35.9, "height": 20.2}}},
        "lens": {"pinholeFocalLength": 20.7},
        "transforms": [{"translation": {"x": x, "y": y, "z": z},
                        "rotation": {"pan": -pan, "tilt": tilt, "roll": 0}}]}
    if code:
        sample["timing"]["timecode"] = code
    payload = json.dumps(sample).encode()
    header = b"OTrk" + struct.pack(">BBHIH", 0, 1, sequence & 0xFFFF, 0, 0x8000 | len(payload))
    return header + struct.pack(">H", fletcher16(header + payload)) + payload


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--protocol", choices=["freed", "opentrackio"], default="freed")
    parser.add_argument("--to", default="127.0.0.1", help="address or multicast group")
    parser.add_argument("--port", type=int, default=40000)
    parser.add_argument("--camera", type=int, default=1, help="number of the camera, 1 to 200")
    parser.add_argument("--rate", type=float, default=100, help="packets per second")
    parser.add_argument("--timecode", type=int, default=0, metavar="RATE",
                        help="adds timecodes of so many whole frames a second (OpenTrackIO)")
    parser.add_argument("--seconds", type=float, default=60, help="how long it sends")
    parser.add_argument("--speed", type=float, default=30, help="degrees per second on the circle")
    parser.add_argument("--radius", type=float, default=2.7, help="metres")
    parser.add_argument("--zoom", type=int, nargs=2, default=[0, 0], metavar=("FROM", "TO"),
                        help="zoom's encoder goes to and fro between these in 8 s (FreeD)")
    parser.add_argument("--focus", type=int, default=0, help="focus's encoder (FreeD)")
    parser.add_argument("--jitter", type=float, default=0,
                        help="packets wait for up to so many milliseconds, as at a switch")
    parser.add_argument("--height", type=float, default=1.5, help="metres")
    options = parser.parse_args()

    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    begin, taken = time.monotonic(), time.time()
    tilt = math.degrees(math.atan2(0.98 - options.height, options.radius))
    for count in range(round(options.seconds * options.rate)):
        waits = random.uniform(0, options.jitter * 1e-3)
        time.sleep(max(0, begin + count / options.rate + waits - time.monotonic()))
        angle = options.speed * count / options.rate
        pan = -(angle + 180) % 360 - 180
        place = (options.radius * math.sin(math.radians(angle)),
                 -options.radius * math.cos(math.radians(angle)), options.height)
        low, high = options.zoom
        zoom = low + (high - low) * (1 - abs(count / options.rate / 4 % 2 - 1))
        packet = freed(options.camera, pan, tilt, place, zoom, options.focus) if options.protocol == "freed" else \
            opentrackio(options.camera, pan, tilt, place, count, taken + count / options.rate,
                        options.timecode and timecode(count / options.rate, options.timecode))
        sender.sendto(packet, (options.to, options.port))


if __name__ == "__main__":
    main()
