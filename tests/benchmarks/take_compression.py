#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Records takes, writes them again with each of takesink's compressions, and prints the tables of
docs/benchmarks-network.md: bytes, processor time of takesink and takesrc, and errors.

    tests/benchmarks/take_compression.py     (in a `meson devenv`)

Real views where POLYHULL_DATA holds utrecht_voxel.
"""
import json
import os
import subprocess
import sys
import tempfile

FRAMES = 100
WAYS = {
    "`none`": "compression=none",
    "`exact`": "compression=exact",
    "`exact`, each alone": "compression=exact key-interval=1",
    "`lossy`": "compression=lossy",
    "`lossy`, .5 mm, quantizer 30": "compression=lossy precision=.5 quantizer=30",
}


def run(folder, line):
    """Runs the line; what polyhull-run says of it."""
    figures = folder + "/figures.json"
    program = ["polyhull-run", "--quiet", "--json", figures] + line.split()
    done = subprocess.run(program, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{line}\n{done.stdout}{done.stderr}")
    with open(figures, encoding="utf-8") as file:
        return json.load(file)


def record(folder):
    """The takes, by what they hold."""
    takes = {}

    def add(name, line):
        takes[name] = f"{folder}/{len(takes)}.take"
        run(folder, line.replace("TAKE", f"takesink location={takes[name]}"))

    def silhouette(camera):
        return f"rigtestsrc camera={camera} noise=3 num-buffers={FRAMES} ! silhouette camera={camera} !"

    add("Synthetic views", silhouette("cam0") + " TAKE")
    room = os.path.join(os.environ.get("POLYHULL_DATA", ""), "utrecht_voxel/cam1")
    if os.path.exists(room + "/video.avi"):
        plate = folder + "/plate.png"
        run(folder, f"filesrc location={room}/background.avi ! avidemux ! avdec_mpeg4 ! videoconvert "
                    f"! pngenc snapshot=true ! filesink location={plate}")
        add("Real views", f"filesrc location={room}/video.avi ! avidemux ! avdec_mpeg4 ! identity "
                          f"eos-after={FRAMES} ! chromamatte method=difference clean-plate={plate} "
                          "shadow-darkest=0.5 difference-low=10 difference-high=28 close=4 choke=0.5 "
                          "! gaussblur sigma=2 ! contourfind camera=cam1 keep-largest=1 "
                          "min-hole-area=100 ! TAKE")
    else:
        print("no real views: POLYHULL_DATA does not hold utrecht_voxel")
    add("Meshes in the colours of four cameras", "hullbuild name=h ! hulltexture ! TAKE " + " ".join(
        silhouette(f"cam{i}") + " queue ! h." for i in range(4)))
    return takes


def main():
    with tempfile.TemporaryDirectory() as folder:
        for name, take in record(folder).items():
            print(f"\n| {name} | bytes a frame | write, ms | read, ms | PSNR, dB | vertices, mm |\n"
                  "|---|---|---|---|---|---|")
            for way, settings in WAYS.items():
                packed = folder + "/packed.take"
                written = run(folder, f"takesrc location={take} ! takesink name=t existing=replace "
                                      f"location={packed} {settings}")
                read = run(folder, f"takesrc name=s location={packed} ! fakesink sync=false")
                sink = written["stats"]["t"]
                print(f"| {way} | {sink['bytes-stored'] / sink['buffers']:,.0f} | "
                      f"{written['elements']['t']['cpu_ms_per_buffer']:.2f} | "
                      f"{read['elements']['s']['cpu_ms_per_buffer']:.2f} | "
                      f"{sink.get('picture-psnr', 0):.1f} | {sink.get('vertex-error-mm', 0):.3f} |",
                      flush=True)


if __name__ == "__main__":
    main()
