#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The lines that pipelines/cameras-*.sh make: they parse, and the sources are set as was asked for. No
camera is opened."""
import os
import pathlib
import shlex
import subprocess
import sys

import gi

gi.require_version("Gst", "1.0")
from gi.repository import Gst  # noqa: E402

SOURCE = pathlib.Path(os.environ["POLYHULL_SOURCE"])
RIG = SOURCE / "pipelines" / "rigs" / "eight.json"


def line_of(script, *options):
    result = subprocess.run([SOURCE / "pipelines" / script, "--rig", RIG, *options, "--dry-run"],
                            capture_output=True, text=True, check=True)
    words = shlex.split(result.stdout)
    assert words[0] == "gst-launch-1.0", words[:3]
    return Gst.parse_launchv(words[1:])


def elements(pipeline, factory):
    iterator = pipeline.iterate_recurse()
    found = []
    while True:
        result, element = iterator.next()
        if result != Gst.IteratorResult.OK:
            return found[::-1]
        if element.get_factory().get_name() == factory:
            found.append(element)


def check_aravis():
    names = [f"cam{i}" for i in range(8)]
    cameras = " ".join(f"{name}=10.0.{i}.2" for i, name in enumerate(names))
    pipeline = line_of("cameras-aravis.sh", "--cameras", cameras, "--trigger", "Line1", "--pulses", "/dev/ttyS0",
                       "--exposure", "2500", "--gain", "3.5", "--white-balance", "1.4,1.7", "--ptp", "--delay", "12.5")
    sources = elements(pipeline, "aravissrc")
    assert len(sources) == len(elements(pipeline, "triggerstamp")) == 8
    for source in sources:
        assert source.get_property("do-timestamp") and source.get_property("gain") == 3.5
        assert source.get_property("exposure") == 2500
        features = source.get_property("features").split(" ")
        assert all(feature.count("=") == 1 for feature in features), features
        for feature in ("TriggerSource=Line1", "TriggerMode=On", "BalanceRatio=1.7", "PtpEnable=true"):
            assert feature in features, features
    assert {source.get_property("camera-name") for source in sources} == {f"10.0.{i}.2" for i in range(8)}
    assert {element.get_property("camera") for element in elements(pipeline, "silhouette")} == set(names)
    assert {element.get_property("delay") for element in elements(pipeline, "triggerstamp")} == {12500000}
    free = line_of("cameras-aravis.sh", "--cameras", "cam0=a cam1=b")
    assert elements(free, "aravissrc")[0].get_property("features") == "TriggerMode=Off"
    assert not elements(free, "triggerstamp") and not elements(free, "serialtrigger")
    assert len(elements(free, "steadystamp")) == 2 and not elements(pipeline, "steadystamp")
    assert not elements(free, "aravissrc")[0].get_property("do-timestamp")


def check_v4l2():
    pipeline = line_of("cameras-v4l2.sh", "--cameras", "cam0=/dev/video0 cam1=/dev/video2 cam2=/dev/video4 cam3=/dev/video6",
                       "--exposure", "3950", "--gain", "10", "--controls", "focus_absolute=30")
    sources = elements(pipeline, "v4l2src")
    assert len(sources) == len(elements(pipeline, "jpegdec")) == 4
    assert {source.get_property("device") for source in sources} == {f"/dev/video{i}" for i in (0, 2, 4, 6)}
    for source in sources:
        controls = source.get_property("extra-controls")
        for name, value in {"auto_exposure": 1, "exposure_time_absolute": 40, "white_balance_automatic": 0,
                            "white_balance_temperature": 5000, "gain": 10, "focus_absolute": 30}.items():
            assert controls.get_value(name) == value, controls.to_string()


def main():
    Gst.init(None)
    checked = 0
    for factory, check in (("aravissrc", check_aravis), ("v4l2src", check_v4l2)):
        if Gst.ElementFactory.find(factory) is None:
            print(f"left out: there is no {factory}")
            continue
        check()
        checked += 1
        print(f"ok {factory}")
    sys.exit(0 if checked else 77)


if __name__ == "__main__":
    main()
