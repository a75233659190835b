#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Holds what two builds make against each other, byte for byte: for changes that must not change it.

  tests/outputs.py write BUILD-DIRECTORY FOLDER   runs every stage of that build, writes what comes out
  tests/outputs.py compare FOLDER FOLDER          prints which files differ; pictures of composite and
                                                  scenesrc may differ by one level
"""
import argparse
import os
import pathlib
import subprocess
import sys

SOURCE = pathlib.Path(__file__).resolve().parent.parent
CAMERAS = ["cam0", "cam1", "cam2", "cam3"]
SCENES = ["figure_N4_n200", "figure_N8_n200", "dup_figure_N4_n200", "ring_figure_N8_n200",
          "tiny_figure_N8_n200", "knot_N8_n800"]


def cameras(source, stages, target):
    """One branch per camera; {} stands for the camera's name."""
    return " ".join(f"{source} ! {stages} ! {target}".replace("{}", name) for name in CAMERAS)


def pipelines():
    """Name to pipeline; $OUT stands for the folder."""
    source = ("rigtestsrc camera={} num-buffers=4 noise=2 spill=0.3 unevenness=0.15 shadow=0.3 ! "
              "video/x-raw,format=%s,framerate=25/1")
    i420, rgb = source % "I420", source % "RGBx"
    trace = "chromamatte ! gaussblur sigma=1.5 ! contourfind camera={} tolerance=0.7 min-area=100"
    hull = "hullbuild name=hull"
    found = {}
    for name, of in ("i420", i420), ("rgb", rgb):
        found[f"camera-{name}"] = cameras(of, "queue", f"multifilesink location=$OUT/{name}-{{}}-%d.raw")
        found[f"matte-{name}"] = cameras(of, "chromamatte", f"multifilesink location=$OUT/matte-{name}-{{}}-%d.raw")
    for method in "soft", "prototype", "difference":
        found[f"method-{method}"] = (f"{rgb} ! chromamatte method={method} ! "
                                     f"multifilesink location=$OUT/{method}-%d.raw").replace("{}", "cam0")
    found["blur"] = cameras(i420, "chromamatte ! gaussblur sigma=2.5", "multifilesink location=$OUT/blur-{}-%d.raw")
    found["views"] = cameras(i420, trace, "multifilesink location=$OUT/view-{}-%d.bin")
    found["silhouettes"] = cameras(rgb, "silhouette camera={}", "multifilesink location=$OUT/silhouette-{}-%d.bin")
    found["hulls"] = cameras(i420, trace, "hull.") + f" {hull} ! multifilesink location=$OUT/hull-%d.bin"
    found["hulls-deviation"] = (cameras(rgb, "silhouette camera={}", "hull.") +
                                f" {hull} max-deviation=0.004 ! multifilesink location=$OUT/simple-%d.bin")
    for name, how in ("direct", "method=direct"), ("blend", "metric=camera-normal"), ("view", "metric=viewing-angle"):
        found[f"texture-{name}"] = (cameras(i420, trace, "hull.") + f" {hull} ! hulltexture {how} ! "
                                    f"multifilesink location=$OUT/{name}-%d.bin")
    for quality in "fast", "good", "fine":
        found[f"refined-{quality}"] = (cameras(i420, trace, "hull.") + f" {hull} ! hullrefine quality={quality} ! "
                                       f"multifilesink location=$OUT/refined-{quality}-%d.bin")
    for form in "obj", "ply", "glb":
        found[f"files-{form}"] = (cameras(i420, trace, "hull.") + f" {hull} ! hulltexture ! "
                                  f"hullexport location=$OUT/file-%d.{form}")
    found["scene"] = ("scenesrc path=orbit num-buffers=3 ! video/x-raw,width=320,height=180,framerate=25/1 ! "
                      "multifilesink location=$OUT/picture-scene-%d.raw")
    for shadow in "off", "hard", "fast", "good", "best":
        found[f"composite-{shadow}"] = (
            cameras(i420, trace, "hull.") + f" {hull} ! hulltexture ! mix.mesh_0 scenesrc path=orbit "
            "num-buffers=3 ! video/x-raw,width=480,height=270,framerate=25/1 ! mix.background "
            f"composite name=mix shadow={shadow} ! multifilesink location=$OUT/picture-{shadow}-%d.raw")
    return found


def run(line):
    """Runs a pipeline to its end, with a base time of 0, so that capture times are the same each time."""
    import gi  # Debian's python3-gi
    gi.require_version("Gst", "1.0")
    from gi.repository import Gst
    Gst.init(None)
    pipeline = Gst.parse_launch(line)
    pipeline.set_start_time(Gst.CLOCK_TIME_NONE)
    pipeline.set_base_time(0)
    pipeline.set_state(Gst.State.PLAYING)
    message = pipeline.get_bus().timed_pop_filtered(Gst.CLOCK_TIME_NONE, Gst.MessageType.ERROR | Gst.MessageType.EOS)
    pipeline.set_state(Gst.State.NULL)
    if message.type == Gst.MessageType.ERROR:
        sys.exit(f"{line}\n{message.parse_error()}")


def write(build, folder):
    folder.mkdir(parents=True, exist_ok=True)
    environment = dict(os.environ, GST_PLUGIN_PATH=str(build / "plugins"), GST_REGISTRY=str(folder / "registry"),
                       GST_GL_PLATFORM="egl", GST_GL_WINDOW="egl-device",
                       LD_LIBRARY_PATH=f"{build}/lib:{build}/plugins")
    for name, line in pipelines().items():
        print(name, flush=True)
        subprocess.run([sys.executable, __file__, "run", line.replace("$OUT", str(folder))], check=True,
                       env=environment, stdout=subprocess.DEVNULL)
    data = SOURCE.parent / "shared" / "data" / "hull_scenes"
    for scene in SCENES if data.is_dir() else []:
        print(scene, flush=True)
        subprocess.run([build / "tools/polyhull-hull", data / f"{scene}.json", "-o", folder / f"{scene}.ply"],
                       check=True, env=environment, stdout=subprocess.DEVNULL)
    rig = subprocess.run([build / "tools/polyhull-rig", "export"], check=True, env=environment, capture_output=True)
    (folder / "rig.json").write_bytes(rig.stdout)
    (folder / "registry").unlink()


def compare(first, second):
    same, levels, other = 0, [0, 0], []
    names = sorted({p.name for p in first.iterdir()} | {p.name for p in second.iterdir()})
    for name in names:
        a, b = first / name, second / name
        if not a.exists() or not b.exists():
            other.append(f"{name}: only in {first if a.exists() else second}")
            continue
        a, b = a.read_bytes(), b.read_bytes()
        if a == b:
            same += 1
        elif name.startswith("picture-") and len(a) == len(b) and max(abs(x - y) for x, y in zip(a, b)) <= 1:
            levels[0] += 1
            levels[1] += sum(x != y for x, y in zip(a, b))
        else:
            other.append(f"{name}: differs ({len(a)} and {len(b)} bytes)")
    print("\n".join(other))
    print(f"{len(names)} files: {same} the same, {levels[0]} pictures within one level "
          f"({levels[1]} samples), {len(other)} different")
    return not other


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    for name, arguments in ("write", ["build", "folder"]), ("compare", ["first", "second"]):
        command = commands.add_parser(name)
        for argument in arguments:
            command.add_argument(argument, type=lambda path: pathlib.Path(path).resolve())
    commands.add_parser("run").add_argument("line")
    options = parser.parse_args()
    if options.command == "run":
        run(options.line)
    elif options.command == "write":
        write(options.build, options.folder)
    elif not compare(options.first, options.second):
        sys.exit(1)


if __name__ == "__main__":
    main()
