#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs pipelines through every element under GStreamer's leaks tracer and fails if any object, buffer,
event or message is still alive after gst_deinit()."""
import json
import os
import socket
import struct
import subprocess
import sys
import tempfile

CAMERA = ("rigtestsrc camera=cam{0} num-buffers=3 ! chromamatte ! gaussblur ! "
          "contourfind camera=cam{0} ! h. ")
CAMERAS = "".join(CAMERA.format(i) for i in range(4))
PIPELINES = {
    "nothing of ours": "videotestsrc num-buffers=3 ! fakesink",
    "camera to contours": "rigtestsrc camera=cam0 num-buffers=3 ! chromamatte ! gaussblur ! "
                          "contourfind camera=cam0 ! fakesink",
    "one pass": "rigtestsrc camera=cam0 num-buffers=3 ! silhouette camera=cam0 ! fakesink",
    "hull to files": CAMERAS + "hullbuild name=h ! hulltexture ! "
                               "hullexport location={folder}/hull-%05d.glb",
    "whole chain": CAMERAS + "hullbuild name=h ! hullrefine ! hulltexture ! c.mesh_0 "
                             "scenesrc num-buffers=3 ! video/x-raw,width=320,height=180 ! "
                             "c.background composite name=c ! fakesink",
    "to a take": "rigtestsrc camera=cam0 num-buffers=3 ! silhouette camera=cam0 ! "
                 "viewencode coding=zstd ! takesink location={folder}/leaks.take",
    "from a take": "takesrc location={folder}/leaks.take ! viewdecode ! fakesink",
    "tracked camera": "tracksrc location={folder}/leaks.pcap ! t.track tracksrc port=0 ! s.track "
                      "scenesrc name=s num-buffers=3 is-live=true ! video/x-raw,width=64,height=36 ! "
                      "fakesink videotestsrc num-buffers=30 ! trackstamp name=t ! fakesink",
    "another program's scene": "filesrc location={folder}/leaks.jsonl ! t.scene videotestsrc num-buffers=9 ! "
                               "video/x-raw,format=GRAY16_LE,framerate=25/1 ! t.depth videotestsrc num-buffers=9 ! "
                               "video/x-raw,framerate=25/1 ! trackstamp name=t scene-match=stream-time ! fakesink",
    "served and received": "rigtestsrc camera=cam0 is-live=true num-buffers=90 ! silhouette "
                           "camera=cam0 ! gdppay ! viewserversink host=127.0.0.1 port={port} "
                           "viewclientsrc port={port} max-age=0 retry=20000000 ! "
                           "identity eos-after=5 ! fakesink",
    "error on the way": "rigtestsrc rig=/nowhere/rig.json camera=cam0 ! chromamatte ! fakesink",
}


def record_track(path):
    """Thirty poses of FreeD, 40 ms apart, in a file of libpcap."""
    freed = bytes([0xD1, 1]) + bytes(26) + bytes([0x40 - 0xD1 - 1 & 0xFF])
    packet = struct.pack(">BBHHHBBHII", 0x45, 0, 57, 0, 0, 64, 17, 0, 0x7F000001, 0) + \
        struct.pack(">HHHH", 4000, 55555, 37, 0) + freed
    with open(path, "wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, 65535, 101))
        for i in range(30):
            file.write(struct.pack("<IIII", 0, i * 33000000, len(packet), len(packet)) + packet)


def write_announcements(path):
    """Of nine frames at 25 frames a second."""
    with open(path, "w") as lines:
        for i in range(9):
            lines.write(json.dumps({
                "format": "polyhull-announcement", "version": 1, "scene": "", "lights": [], "exposure": 1,
                "ambient": [0, 0, 0], "depth_near": 0.5, "stream_time_ns": 40_000_000 * i,
                "viewport": {"width": 320, "height": 240, "K": [300, 0, 159.5, 0, 300, 119.5, 0, 0, 1],
                             "R": [1, 0, 0, 0, -1, 0, 0, 0, -1], "t": [0, 1, 4 + i]}}) + "\n")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def run(name, pipeline, folder):
    """Whether nothing is left, and the pipeline ended as it should."""
    environment = dict(os.environ, GST_TRACERS="leaks", GST_DEBUG="GST_TRACER:7", GST_DEBUG_NO_COLOR="1")
    result = subprocess.run(["gst-launch-1.0", "-q", *pipeline.format(folder=folder, port=free_port()).split()],
                            env=environment, capture_output=True, text=True, timeout=240)
    alive = [line for line in result.stderr.splitlines()
             if "object-alive, type-name=(string)" in line and "new format" not in line]
    expected_failure = name == "error on the way"
    broken = (result.returncode != 0) != expected_failure
    print(f"{'FAILED' if alive or broken else 'ok'}: {name}: {len(alive)} objects left")
    if alive or broken:
        print("\n".join(alive[:20]) if alive else result.stderr[-3000:])
    return not alive and not broken


def main():
    # One folder for all: a take is written and then played.
    with tempfile.TemporaryDirectory() as folder:
        record_track(f"{folder}/leaks.pcap")
        write_announcements(f"{folder}/leaks.jsonl")
        return 0 if all([run(name, pipeline, folder) for name, pipeline in PIPELINES.items()]) else 1


if __name__ == "__main__":
    sys.exit(main())
