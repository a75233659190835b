#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""How far it scales: as many capture machines as wanted, a server that builds the hull, and machines that
composite it, each in a network namespace of this machine, by pipelines/capture.sh and server.sh. Prints
what the stages cost an instant, which sets were whole, and what each machine used.

usage: tests/network/scale.py --cameras N [--composites M] [--rate R] [--width W] [--seconds S]

Needs root, iproute2 with veth links, and polyhull-run in PATH (a `meson devenv`); nothing outside the
namespaces is touched. Processor time is what counts: all machines share this one's cores."""
import argparse
import json
import math
import os
import shlex
import signal
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
NAME = f"ph{os.getpid()}"


def ring(count, width):
    """Cameras around the stage at two heights, as a rig file; each looks at a person's middle."""
    cameras = []
    for i in range(count):
        angle, height = 2 * math.pi * (i + 0.3) / count, (1.2, 2.4)[i % 2]
        eye = (3.0 * math.cos(angle), height, 3.0 * math.sin(angle))
        look = [t - e for t, e in zip((0.0, 0.95, 0.0), eye)]
        length = math.hypot(*look)
        z = [v / length for v in look]
        flat = math.hypot(z[0], z[2])
        x = [-z[2] / flat, 0.0, z[0] / flat]
        y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
        turn = [x, y, z]
        tall = width * 3 // 4
        cameras.append({"name": f"cam{i}", "width": width, "height": tall,
                        "K": [[0.68 * width, 0, width / 2 - 0.5], [0, 0.68 * width, tall / 2 - 0.5], [0, 0, 1]],
                        "R": turn, "t": [-sum(r * e for r, e in zip(row, eye)) for row in turn]})
    return {"format": "polyhull-rig", "version": 1, "up": [0, 1, 0], "unit": "m",
            "bounds": {"min": [-1.2, 0, -1.2], "max": [1.2, 2.3, 1.2]}, "cameras": cameras}


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def machine(name, number):
    """A namespace with a link to the server's; the addresses of the server and of itself on it."""
    server, own = f"10.79.{number}.1", f"10.79.{number}.2"
    ip("netns", "add", name)
    ip("link", "add", f"{NAME}a{number}", "type", "veth", "peer", "name", f"{NAME}b{number}")
    for end, space, address in ((f"{NAME}a{number}", f"{NAME}-server", server), (f"{NAME}b{number}", name, own)):
        ip("link", "set", end, "netns", space)
        ip("-n", space, "address", "add", f"{address}/24", "dev", end)
        ip("-n", space, "link", "set", end, "up")
    return server, own


def start(space, line, output):
    # A capture machine whose clock is not there yet ends, and is started again.
    loop = f"for attempt in 1 2 3 4 5; do {line} && break; done"
    return subprocess.Popen(["ip", "netns", "exec", space, "bash", "-c", loop], stdout=output, stderr=output, start_new_session=True)


def used(groups):
    """Processor time of all processes of these groups, s."""
    ticks = 0
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{entry}/stat") as file:
                words = file.read().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(words[2]) in groups:
            ticks += int(words[11]) + int(words[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def script(name, *words):
    return subprocess.run([f"{ROOT}/pipelines/{name}", *words, "--dry-run"], check=True, capture_output=True, text=True).stdout.strip()


def end(group, how=signal.SIGINT):
    try:
        os.killpg(group.pid, how)
    except ProcessLookupError:
        pass


def report(folder, arguments, costs, window):
    n = arguments.cameras
    with open(f"{folder}/server.json") as file:
        figures = json.load(file)
    stats, elements = figures["stats"]["hull"], figures["elements"]
    kinds = {}
    for element in elements.values():
        spent = element["buffers"] * element["cpu_ms_per_buffer"]
        kinds[element["kind"]] = kinds.get(element["kind"], 0) + spent
    sets = max(stats["sets"], 1)
    print(f"{n} cameras of {arguments.width} x {arguments.width * 3 // 4} at {arguments.rate}/s, {arguments.composites} composites")
    print(f"  sets {stats['sets']}, incomplete {stats['sets-incomplete']}, unwanted {stats['sets-unwanted']}; {stats['triangles']} triangles; "
          f"a machine's views reach hullbuild at most {max(v for k, v in stats.items() if k.startswith('lateness-ms-')):.0f} ms late")
    for kind in ("viewclientsrc", "viewdecode", "hullbuild", "hulltexture", "gdppay", "viewserversink"):
        if kind in kinds:
            print(f"  {kind:15} {kinds[kind] / sets:8.2f} ms of processor time a set")
    instants = window * arguments.rate
    print("  of the machines, each, an instant: " +
          ", ".join(f"{name} {1e3 * cost / instants / max(count, 1):.1f} ms" for name, (cost, count) in costs.items()) +
          f"; cores used by all {sum(cost for cost, _ in costs.values()) / window:.2f} of {os.cpu_count()}")
    for m in range(arguments.composites):
        with open(f"{folder}/composite{m}.json") as file:
            figures = json.load(file)
        received = figures["stats"].get("hull", {})
        print(f"  composite {m}: {received.get('frames')} meshes came, {received.get('bytes', 0) / max(received.get('frames', 1), 1) / 1e3:.0f} kB each; "
              f"{figures['frames']} pictures, {figures['frames_per_second']:.1f}/s, " + ", ".join(
                  f"{e['kind']} {e['cpu_ms_per_buffer']:.1f} ms" for e in figures["elements"].values() if e["kind"] in ("viewclientsrc", "composite")))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cameras", type=int, required=True)
    parser.add_argument("--composites", type=int, default=0)
    parser.add_argument("--rate", type=int, default=5)
    parser.add_argument("--width", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=20)
    arguments = parser.parse_args()
    if os.geteuid() != 0:
        print("skipped: network namespaces need root")
        return 77
    folder = tempfile.TemporaryDirectory()
    programs, spaces = {"server": [], "capture": [], "composite": []}, [f"{NAME}-server"]
    try:
        rig = f"{folder.name}/rig.json"
        with open(rig, "w") as file:
            json.dump(ring(arguments.cameras, arguments.width), file)
        ip("netns", "add", spaces[0])
        cameras, lines = [], []
        for i in range(arguments.cameras):
            spaces.append(f"{NAME}-{i}")
            server, own = machine(spaces[-1], i)
            cameras.append(f"cam{i}={own}")
            lines.append(script("capture.sh", "--camera", f"cam{i}", "--server", server, "--link", "250", "--source",
                                f"rigtestsrc rig={rig} camera=cam{i} is-live=true ! video/x-raw,framerate={arguments.rate}/1",
                                "--silhouette", f"rig={rig} trigger-from=none"))
        sink = "queue ! gdppay ! viewserversink port=7500 max-clients=64" if arguments.composites else "fakesink"
        line = script("server.sh", "--rig", rig, "--cameras", " ".join(cameras), "--sink", sink)
        line = line.replace("polyhull-run", f"exec polyhull-run --quiet --count hull --json {folder.name}/server.json", 1)
        output = open(f"{folder.name}/output", "w")
        programs["server"].append(start(spaces[0], line, output))
        time.sleep(2)
        for space, line in zip(spaces[1:], lines):
            programs["capture"].append(start(space, line, output))
            time.sleep(0.1)
        for m in range(arguments.composites):
            spaces.append(f"{NAME}-c{m}")
            server, _ = machine(spaces[-1], 200 + m)
            line = (f"exec polyhull-run --quiet --json {folder.name}/composite{m}.json --clock {server}:7480 "
                    f"viewclientsrc name=hull host={server} port=7500 ! queue ! c.mesh_0 scenesrc is-live=true ! "
                    f"'video/x-raw,width=640,height=360,framerate={arguments.rate}/1' ! queue ! c.background "
                    "composite name=c backend=processor ! fakesink")
            programs["composite"].append(start(spaces[-1], line, output))
        time.sleep(8 + 0.4 * arguments.cameras)
        groups = {name: {p.pid for p in each} for name, each in programs.items() if each}
        before, begin = {name: used(each) for name, each in groups.items()}, time.monotonic()
        time.sleep(arguments.seconds)
        window = time.monotonic() - begin
        costs = {name: (used(each) - before[name], len(each)) for name, each in groups.items()}
        for each in programs["composite"] + programs["server"]:
            end(each)
        for each in programs["composite"] + programs["server"]:
            each.wait(60)
        report(folder.name, arguments, costs, window)
    except (OSError, KeyError, subprocess.SubprocessError) as error:
        print(f"error: {error}", file=sys.stderr)
        with open(f"{folder.name}/output", errors="replace") as file:
            print(file.read()[-3000:], file=sys.stderr)
        return 1
    finally:
        for each in sum(programs.values(), []):
            end(each, signal.SIGKILL)
        for space in spaces:
            subprocess.run(["ip", "netns", "del", space], stderr=subprocess.DEVNULL, check=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
