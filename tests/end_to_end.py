#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""From generated files to pixels: records the four synthetic cameras to files, runs the whole chain on
the files twice, and holds the pictures against the path-traced truth, the hull against its masks.
"""
import filecmp
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

CAMERAS = [f"cam{i}" for i in range(4)]
FRAMES = 5
ANGLE = math.radians(30)  # the viewport stands before cam0
EYE = (2.7 * math.sin(ANGLE), 1.5, 2.7 * math.cos(ANGLE))


def run(*words):
    result = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=300)
    if result.returncode != 0:
        sys.exit(f"failed: {' '.join(map(str, words))}\n{result.stdout}{result.stderr}")
    return result.stdout


def record(folder):
    words = ["gst-launch-1.0", "-q"]
    for camera in CAMERAS:
        words += f"""rigtestsrc camera={camera} num-buffers={FRAMES} noise=2 spill=0.2 !
            video/x-raw,format=I420,framerate=25/1 ! queue ! y4menc !
            filesink location={folder}/{camera}.y4m""".split()
    run(*words)


def chain(folder, output):
    words = ["gst-launch-1.0", "-q"]
    for camera in CAMERAS:
        words += f"""filesrc location={folder}/{camera}.y4m ! y4mdec ! queue ! chromamatte !
            gaussblur sigma=1.5 ! contourfind camera={camera} ! hull.""".split()
    words += f"""hullbuild name=hull ! hulltexture ! tee name=meshes
        meshes. ! queue ! multifilesink async=false location={output}/%d.mesh
        meshes. ! queue ! composite.mesh_0
        scenesrc num-buffers={FRAMES} refinement=never
          eye-x={EYE[0]} eye-y={EYE[1]} eye-z={EYE[2]} target-y=0.98 field-of-view=52 !
        video/x-raw,width=640,height=360,framerate=25/1 ! queue ! composite.background
        composite name=composite ! videoconvert ! pngenc !
        multifilesink async=false location={output}/%d.png""".split()
    run(*words)


def decibels(text):
    """{region: (composite, empty room)} as polyhull-truth prints them."""
    rows = re.findall(r"^(\S.*?)\s+(-?[\d.]+|inf) dB\s+\(empty room\s+(-?[\d.]+|inf) dB\)", text, re.M)
    return {name: (float(ours), float(empty)) for name, ours, empty in rows}


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        record(folder)
        for output in ("first", "second"):
            (folder / output).mkdir()
            chain(folder, folder / output)
        checks = {}
        names = [f"{i}.png" for i in range(FRAMES)] + [f"{i}.mesh" for i in range(FRAMES)]
        checks["as many pictures and meshes as frames"] = all(
            (folder / "first" / n).exists() for n in names)
        checks["the same bytes twice"] = all(
            filecmp.cmp(folder / "first" / n, folder / "second" / n, shallow=False)
            for n in names if n.endswith(".png"))
        last = folder / "first" / f"{FRAMES - 1}"
        run("polyhull-report", "coverage", f"{last}.mesh", "--json", folder / "coverage.json")
        rows = json.loads((folder / "coverage.json").read_text())
        checks["the hull fills each mask"] = len(rows) == 4 and all(
            row["mask"] > 5000 and row["covered"] >= 0.995 * row["mask"]
            and row["outside"] <= 0.01 * row["mask"] for row in rows)
        run("polyhull-report", "closed", *[f"{folder}/first/{i}.mesh" for i in range(FRAMES)])
        text = run("polyhull-truth", f"{last}.png", "--seconds", (FRAMES - 1) / 25, "--shrink", 1,
                   "--samples", 8, "--eye", *EYE, "-o", folder / "truth.png")
        print(text)
        truth = decibels(text)
        checks["the picture is near the truth"] = truth["whole picture"][0] > 29
        checks["so is the subject"] = truth["subject"][0] > 20
        checks["nearer than the empty room"] = all(
            truth[region][0] > truth[region][1] + 3 for region in ("whole picture", "subject"))
        for what, holds in checks.items():
            print(f"{'ok' if holds else 'FAILED'}: {what}")
        return 0 if all(checks.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
