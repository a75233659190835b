#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Measures the whole chain on recorded files, in whole processes: the table of docs/benchmarks.md.

  tests/benchmarks/chain.py PLUGINS [PLUGINS_BEFORE] [--lines good,fast,...] [--cores 1,2,4] [--instants 100]
                            [--rounds 3] [--recordings FOLDER]

PLUGINS: a folder with libgstpolyhull.so. With a second one both are run in turns, and the last columns are
the first's figures over the second's. Each line runs for 20 instants and for all; the difference is what
an instant costs, without the start. --cores runs each line on so many of the machine's cores. The
recordings are made by the first plugins where FOLDER lacks them (four cameras of 1024x768, of 1920x1080
eight: a gigabyte or three) and kept where it is given.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

SHIPPED = pathlib.Path(__file__).resolve().parents[2] / "pipelines" / "rigs" / "eight.json"
START = 20
REGISTRIES = tempfile.TemporaryDirectory()  # one of GStreamer's for each folder of plugins
# name: (cameras, height of their pictures, quality of hullrefine, shadow, height of the composite, does the viewport travel)
LINES = {
    "good": (4, 768, "good", "good", 720, False),
    "fast": (4, 768, "fast", "fast", 720, False),
    "fast-off": (4, 768, "fast", "off", 720, False),
    "hull-fast": (4, 768, None, "fast", 720, False),
    "hull-off": (4, 768, None, "off", 720, False),
    "travel": (4, 768, "good", "good", 720, True),
    "hd-4": (4, 1080, "good", "good", 1080, False),
    "hd-8-mesh": (8, 1080, "good", None, None, False),
}


def recording(folder, height, camera, instants):
    return folder / f"{height}-{instants}-cam{camera}.y4m"


def rig(folder, height):
    """The property of the rig: unset for the built-in one; the shipped eight cameras with pictures of 1920x1080."""
    if height != 1080:
        return []
    path = folder / "rig-1080.json"
    if not path.exists():
        described = json.loads(SHIPPED.read_text())
        for camera in described["cameras"]:
            scale = 1080 / camera["height"]
            camera["K"][0][0] *= scale
            camera["K"][1][1] *= scale
            camera["K"][0][2] = 959.5
            camera["K"][1][2] = 539.5
            camera["width"], camera["height"] = 1920, 1080
        path.write_text(json.dumps(described))
    return [f"rig={path}"]


def launch(plugins, line, cores=None):
    """Runs a line; processor time in s, wall time in s, peak of resident memory in MiB."""
    environment = dict(os.environ, GST_PLUGIN_PATH=plugins, GST_REGISTRY_FORK="no",
                       GST_REGISTRY=f"{REGISTRIES.name}/{abs(hash(plugins))}.bin")
    began = time.monotonic()
    process = subprocess.Popen(["gst-launch-1.0", "-q", *line], env=environment, stdout=subprocess.DEVNULL,
                               preexec_fn=cores and (lambda: os.sched_setaffinity(0, range(cores))))
    _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"error: gst-launch-1.0 {' '.join(line)} ended with status {status}")
    return used.ru_utime + used.ru_stime, time.monotonic() - began, used.ru_maxrss / 1024


def record(plugins, folder, cameras, height, instants):
    missing = [i for i in range(cameras) if not recording(folder, height, i, instants).exists()]
    width = height * 16 // 9 if height == 1080 else height * 4 // 3
    for i in missing:
        launch(plugins, ["rigtestsrc", *rig(folder, height), f"camera=cam{i}", f"num-buffers={instants + 1}", "!",
                         f"video/x-raw,format=I420,width={width},height={height},framerate=25/1", "!", "y4menc", "!",
                         "filesink", f"location={recording(folder, height, i, instants)}"])


def describe(folder, name, instants, recorded):
    cameras, height, refine, shadow, output, travels = LINES[name]
    line = ["hullbuild", "name=hull", *rig(folder, height), "!"]
    if refine:
        line += f"queue max-size-buffers=2 ! hullrefine quality={refine} ! queue max-size-buffers=2 !".split()
    line += ["hulltexture", "!"]
    if output:
        line += f"""queue max-size-buffers=2 ! composite.mesh_0
            scenesrc refinement=never num-buffers={instants}{" path=orbit orbit-start=30 orbit-speed=45" if travels else ""} !
            video/x-raw,width={output * 16 // 9},height={output},framerate=25/1 ! queue max-size-buffers=2 !
            composite.background composite name=composite shadow={shadow} !""".split()
    line.append("fakesink")
    for i in range(cameras):
        line += f"""filesrc blocksize=1048576 location={recording(folder, height, i, recorded)} ! y4mdec ! identity eos-after={instants + 1} !
            queue max-size-buffers=2 ! silhouette camera=cam{i} ! hull.""".split()
    return line


def measure(plugins, folder, name, instants, cores):
    """What an instant costs: processor time in ms; frames a second; and the peak of memory in MiB."""
    few = launch(plugins, describe(folder, name, START, instants), cores)
    all = launch(plugins, describe(folder, name, instants, instants), cores)
    return (all[0] - few[0]) / (instants - START) * 1e3, (instants - START) / (all[1] - few[1]), all[2]


def main():
    options = argparse.ArgumentParser(usage=__doc__)
    options.add_argument("plugins", nargs="+")
    options.add_argument("--lines", default=",".join(LINES))
    options.add_argument("--cores", default="")
    options.add_argument("--instants", type=int, default=100)
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--recordings", type=pathlib.Path)
    chosen = options.parse_args()
    names = chosen.lines.split(",")
    if len(chosen.plugins) > 2 or not set(names) <= set(LINES):
        options.error(f"one or two folders of plugins; lines: {', '.join(LINES)}")
    cores = [int(n) for n in chosen.cores.split(",") if n] or [None]
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.recordings or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            record(chosen.plugins[0], folder, LINES[name][0], LINES[name][1], chosen.instants)
        print("| line | cores | processor time, ms | frames/s | memory, MiB |")
        print("|---|---|---|---|---|")
        for name in names:
            for count in cores:
                found = [[measure(plugins, folder, name, chosen.instants, count) for plugins in chosen.plugins]
                         for _ in range(chosen.rounds)]
                # By plugins, then by figure.
                medians = [[statistics.median(run[i][k] for run in found) for k in range(3)]
                           for i in range(len(chosen.plugins))]
                cells = []
                for k, digits in enumerate((1, 1, 0)):
                    cell = " / ".join(f"{median[k]:.{digits}f}" for median in medians)
                    if len(medians) == 2:
                        cell += f" = {medians[0][k] / medians[1][k]:.2f}"
                    cells.append(cell)
                print(f"| {name} | {count or len(os.sched_getaffinity(0))} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
