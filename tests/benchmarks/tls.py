#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""What TLS costs a capture machine: processor time of a frame of 1080p views that viewserversink sends,
as they are and packed, with and without TLS, and how much later frames arrive. The rounds take turns, so
that a busy machine slows all alike.

usage: tests/benchmarks/tls.py [--rounds N] [--frames N]     (in a `meson devenv`)"""
import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile

import gi

gi.require_version("Gst", "1.0")
from gi.repository import Gst

RATE = 50
SKIPPED = 20  # frames, until everything runs


def play(line, probe=None, element="probed"):
    """Plays it to its end; base time and processor time (s) from frame SKIPPED on, of a frame."""
    pipeline = Gst.parse_launch(line)
    count, begin = 0, None

    def passed(_pad, info):
        nonlocal count, begin
        count += 1
        if count == SKIPPED:
            begin = used()
        if probe:
            probe(info.get_buffer().pts, pipeline.get_clock().get_time())
        return Gst.PadProbeReturn.OK

    pipeline.get_by_name(element).get_static_pad("src").add_probe(Gst.PadProbeType.BUFFER, passed)
    pipeline.set_state(Gst.State.PLAYING)
    message = pipeline.get_bus().timed_pop_filtered(120 * Gst.SECOND, Gst.MessageType.ERROR | Gst.MessageType.EOS)
    if message is None or message.type == Gst.MessageType.ERROR:
        sys.exit(f"{line}: {message.parse_error() if message else 'it does not end'}")
    time = (used() - begin) / (count - SKIPPED)
    base = pipeline.get_base_time()
    pipeline.set_state(Gst.State.NULL)
    return base, time, count


def used():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def send(take, coding, sink):
    packing = "" if coding == "none" else f"viewencode coding={coding} !"
    base, time, count = play(f"takesrc location={take} ! queue ! identity name=probed sync=true ! {packing} gdppay ! {sink}")
    print(base, time, count)


def receive(line):
    arrivals = []
    _, time, _ = play(line, lambda pts, now: arrivals.append((pts, now)))
    return arrivals, time


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=150)
    parser.add_argument("--send", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--receive", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    Gst.init(None)
    if arguments.send:
        return send(*arguments.send)
    if arguments.receive:
        arrivals, time = receive(arguments.receive)
        print(time)
        for pair in arrivals:
            print(*pair)
        return None
    folder = tempfile.TemporaryDirectory()
    keys = f"{folder.name}/keys"
    source = os.environ["POLYHULL_SOURCE"]
    subprocess.run([f"{source}/pipelines/make-keys.sh", keys, "capture", "server"], check=True, stdout=subprocess.DEVNULL)
    take = f"{folder.name}/views.take"
    rig = f"{folder.name}/rig.json"
    big_rig(f"{source}/pipelines/rigs/five.json", rig)
    subprocess.run(["gst-launch-1.0", "-q", *f"rigtestsrc rig={rig} camera=cam0 noise=3 num-buffers={arguments.frames} ! "
                    f"video/x-raw,framerate={RATE}/1 ! silhouette rig={rig} camera=cam0 ! takesink location={take}".split()],
                   check=True)
    print(f"{os.path.getsize(take) / arguments.frames / 1000:.0f} kB a view")
    results = {}
    for _ in range(arguments.rounds):
        for coding in "none", "lz4", "zstd", "jpeg":
            for way in "discarded", "plain", "tls":
                results.setdefault((coding, way), []).append(run(take, keys, coding, way, arguments.frames))
    print(f"{'coding':8}{'no link':>10}{'plain':>10}{'TLS':>10}{'taken, plain':>14}{'TLS':>8}   ms of processor time a frame"
          f"   {'latency, plain':>16}{'TLS':>8}   ms, median")
    for coding in "none", "lz4", "zstd", "jpeg":
        row = [statistics.median(r[i] for r in results[coding, way])
               for way, i in (("discarded", 0), ("plain", 0), ("tls", 0), ("plain", 1), ("tls", 1), ("plain", 2), ("tls", 2))]
        print(f"{coding:8}{row[0]:10.2f}{row[1]:10.2f}{row[2]:10.2f}{row[3]:14.2f}{row[4]:8.2f}{'':32}{row[5]:16.2f}{row[6]:8.2f}")
    return None


def big_rig(source, target):
    """1920 x 1440 pixels where the rig has 1024 x 768; of them the middle 1080 rows."""
    import json
    with open(source) as file:
        rig = json.load(file)
    for camera in rig["cameras"]:
        scale = 1920 / camera["width"]
        camera["K"] = [[camera["K"][0][0] * scale, 0, 959.5], [0, camera["K"][1][1] * scale, 539.5], [0, 0, 1]]
        camera["width"], camera["height"] = 1920, 1080
    with open(target, "w") as file:
        json.dump(rig, file)


def run(take, keys, coding, way, frames):
    """Processor time of the sender and of the receiver, ms a frame, and latency, ms."""
    itself = [sys.executable, __file__]
    sink, port = "fakesink", 0
    if way != "discarded":
        port = 7800
        secret = f"tls-certificate={keys}/capture.pem tls-authority={keys}/authority.pem" if way == "tls" else ""
        sink = f"viewserversink host=127.0.0.1 port={port} buffers-max=10000 {secret}"
    # The receiver tries until the sender is there, and ends with it.
    taker = None
    if port:
        secret = f"tls-certificate={keys}/server.pem tls-authority={keys}/authority.pem tls-name=capture" if way == "tls" else ""
        taker = subprocess.Popen([*itself, "--receive",
                                  f"viewclientsrc name=probed host=127.0.0.1 port={port} retry=5000000 max-age=0 end-with-sender=true {secret} ! fakesink sync=false"],
                                 stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    sent = subprocess.run([*itself, "--send", take, coding, sink], capture_output=True, text=True, check=True)
    base, time, _ = (float(word) for word in sent.stdout.split())
    if not taker:
        return 1e3 * time, 0, 0
    lines = taker.communicate(timeout=60)[0].split("\n")
    # gdppay sends the pipeline's own times.
    late = [1e-6 * (int(now) - int(base) - int(pts)) for pts, now in (line.split() for line in lines[1 + SKIPPED:] if line)]
    return 1e3 * time, 1e3 * float(lines[0]), statistics.median(late)


if __name__ == "__main__":
    sys.exit(main())
