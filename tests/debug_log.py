#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""What GST_DEBUG=ELEMENT:6 prints: each element logs each of its buffers at LOG, and hullbuild says why an
instant was dropped: which one, which camera it lacks, by which setting."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import leaks

LINE = re.compile(r"^\d+:\d\d:\d\d\.\d+ +\d+ +0x\w+ +(\w+) +([\w-]+) ")
CAMERA = "rigtestsrc camera={0} num-buffers={1} ! video/x-raw,framerate={2} ! silhouette camera={0} trigger-from=none ! h. "
# Pipelines of leaks.py, and those that it has not, with how many buffers each of these elements gets.
BUFFERS = {
    "camera to contours": {"rigtestsrc": 3, "chromamatte": 3, "gaussblur": 3, "contourfind": 3},
    "one pass": {"silhouette": 3},
    "hull to files": {"hullbuild": 3, "hullexport": 3},
    "whole chain": {"hullrefine": 3, "hulltexture": 3, "composite": 3, "scenesrc": 3},
    "to a take": {"viewencode": 3, "takesink": 3},
    "from a take": {"takesrc": 3, "viewdecode": 3},
    "tracked camera": {"trackstamp": 30, "tracksrc": 3},
    "served and received": {"viewserversink": 5, "viewclientsrc": 5},
    "camera's own times": {"steadystamp": 3},
    "triggered": {"triggerstamp": 3},
}
PIPELINES = leaks.PIPELINES | {
    "camera's own times": "rigtestsrc is-live=true num-buffers=3 ! steadystamp ! fakesink",
    "triggered": "serialtrigger device={device} rigtestsrc is-live=true num-buffers=3 ! triggerstamp ! fakesink",
}
WITHOUT_BUFFERS = {"serialtrigger"}
# For a pipeline of four cameras: what the log must say.
DROPPED = {
    "a camera that ends": (
        [("cam3", 2, "25/1")], "missing-camera=drop-set",
        r"instant 0:00:00\.080000000 \(cam0 \+0 us, cam1 \+0 us, cam2 \+0 us\) is dropped by "
        r"missing-camera=drop-set: it lacks cam3 \(has ended\)"),
    "a camera that leaves instants out": (
        [("cam1", 3, "25/2")], "missing-camera=freeze",
        r"instant 0:00:00\.040000000 \(cam0 .* is dropped by missing-camera=freeze: it lacks cam1 \("),
    "too few cameras": (
        [("cam2", 2, "25/1")], "missing-camera=drop-camera min-cameras=4",
        r"instant 0:00:00\.080000000 .* is dropped by min-cameras: 3 views, 4 are asked for; "
        r"it lacks cam2 \(has ended\)"),
    "a camera that ends, and the others go on": (
        [("cam3", 2, "25/1")], "missing-camera=drop-camera",
        r"instant 0:00:00\.120000000 .* is built by missing-camera=drop-camera without cam3 \(has ended\)"),
}


def log_of(pipeline, elements):
    """The lines that \"GST_DEBUG=ELEMENT:6\" of these elements gives, as (level, category, line)."""
    debug = ",".join(f"{element}:6" for element in elements)
    result = subprocess.run(["gst-launch-1.0", "-q", *pipeline.split()], capture_output=True, text=True, timeout=240,
                            env=dict(os.environ, GST_DEBUG=debug, GST_DEBUG_NO_COLOR="1"))
    assert result.returncode == 0, f"{pipeline}\n{result.stderr[-3000:]}"
    return [(*found.groups(), line) for line in result.stderr.splitlines() if (found := LINE.match(line))]


def check_buffers(folder):
    failures = 0
    terminal, other = os.openpty()
    for name, elements in BUFFERS.items():
        log = log_of(PIPELINES[name].format(folder=folder, port=leaks.free_port(), device=os.ttyname(other)), elements)
        for element, buffers in elements.items():
            times = {time for level, category, line in log if (level, category) == ("LOG", element)
                     for time in re.findall(r"\bpts (\d+:\d\d:\d\d\.\d+)", line)}
            good = len(times) >= buffers
            failures += not good
            print(f"{'ok' if good else 'FAILED'}: {element} logs {len(times)} buffers of {buffers}")
    os.close(terminal)
    os.close(other)
    return failures


def check_dropped():
    failures = 0
    for name, (others, settings, wanted) in DROPPED.items():
        cameras = {f"cam{i}": (5, "25/1") for i in range(4)} | {camera: rest for camera, *rest in others}
        pipeline = "".join(CAMERA.format(camera, *rest) for camera, rest in cameras.items())
        log = log_of(f"{pipeline}hullbuild name=h {settings} ! fakesink", ["hullbuild"])
        said = [line for level, _, line in log if level == "DEBUG"]
        good = any(re.search(wanted, line) for line in said)
        failures += not good
        print(f"{'ok' if good else 'FAILED'}: {name}" + ("" if good else "\n" + "\n".join(said)))
    return failures


def main():
    plugins = pathlib.Path(os.environ["POLYHULL_SOURCE"]) / "plugins"
    elements = {folder.name for folder in plugins.iterdir() if folder.is_dir()} - {"common", "precompiled"} - WITHOUT_BUFFERS
    missing = elements - {element for known in BUFFERS.values() for element in known}
    assert not missing, f"no pipeline here has {missing}: add one"
    with tempfile.TemporaryDirectory() as folder:
        leaks.record_track(folder + "/leaks.pcap")
        failures = check_buffers(folder) + check_dropped()
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
