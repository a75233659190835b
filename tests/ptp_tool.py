#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""polyhull-run by a PTP clock: a grandmaster (Debian's linuxptp) and two machines that follow it, in network
namespaces. Skipped where there is no linuxptp, or no right to make namespaces.

usage: ptp_tool.py POLYHULL_RUN"""
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

PROGRAM = sys.argv.pop(1)
SKIPPED = 77
ZERO = 1577836800  # of running time, as `date --utc --date 2020-01-01 +%s` has it

MASTER = """[global]
time_stamping software
free_running 1
network_transport UDPv4
delay_mechanism E2E
logAnnounceInterval -1
logSyncInterval -2
logMinDelayReqInterval -2
"""


def skip(why):
    print("skipped:", why)
    sys.exit(SKIPPED)


class Stage:
    """Two namespaces with a link between them; the grandmaster is in the first."""

    def __init__(self, folder):
        self.folder = folder
        self.started, self.spaces = [], []
        for _ in range(2):
            space = subprocess.Popen(["unshare", "-n", "sleep", "600"])
            self.started.append(space)
            self.spaces.append(space.pid)
        mine = os.readlink("/proc/self/ns/net")
        for pid in self.spaces:
            for _ in range(100):
                if os.readlink(f"/proc/{pid}/ns/net") != mine:
                    break
                time.sleep(0.05)
            else:
                raise OSError("no namespace was made")
        self.within(0, "ip", "link", "add", "ptp0", "type", "veth", "peer", "name", "ptp1")
        self.within(0, "ip", "link", "set", "ptp1", "netns", str(self.spaces[1]))
        for i in range(2):
            self.within(i, "ip", "link", "set", "lo", "up")
            self.within(i, "ip", "addr", "add", f"10.9.0.{i + 1}/24", "dev", f"ptp{i}")
            self.within(i, "ip", "link", "set", f"ptp{i}", "up")
            # Without a way to anywhere there is none to groups.
            self.within(i, "ip", "route", "add", "224.0.0.0/4", "dev", f"ptp{i}")

    def command(self, space, *words):
        return ["nsenter", "-t", str(self.spaces[space]), "-n", *words]

    def within(self, space, *words):
        subprocess.run(self.command(space, *words), check=True, capture_output=True)

    def master(self):
        """The grandmaster, once it has taken that role; None where it does not."""
        file, log = self.folder / "master.cfg", self.folder / "master.log"
        file.write_text(MASTER + f"uds_address {self.folder}/master.sock\n")
        with open(log, "w") as to:
            master = subprocess.Popen(self.command(0, "ptp4l", "-f", str(file), "-i", "ptp0", "-m"), stdout=to,
                                      stderr=to)
        self.started.append(master)
        for _ in range(200):
            if "assuming the grand master role" in log.read_text():
                return master
            if master.poll() is not None:
                return None
            time.sleep(0.1)
        return None

    def close(self):
        for program in reversed(self.started):
            program.kill()
            program.wait()


def times_in(path):
    """Nanoseconds, of the buffers in gdppay's packets."""
    data, at, times = path.read_bytes(), 0, []
    while at + 62 <= len(data):
        kind, size, pts = struct.unpack(">HIQ", data[at + 4:at + 18])
        if kind == 1:
            times.append(pts)
        at += 62 + size
    return times


class Ptp(unittest.TestCase):
    def start(self, *arguments, **options):
        program = subprocess.Popen(STAGE.command(1, PROGRAM, "--quiet", "--brief", *arguments),
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **options)
        watchdog = threading.Timer(60, program.kill)
        watchdog.start()
        self.addCleanup(watchdog.cancel)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        return program

    def said(self, program, words):
        lines = []
        while True:
            line = program.stderr.readline()
            self.assertTrue(line, f"'{words}' is not in {lines}")
            lines.append(line)
            if words in line:
                return

    def test_two_agree(self):
        # Both stamp the same packets as they come, each by the clock that it follows.
        files = [STAGE.folder / f"{i}.gdp" for i in range(2)]
        programs = []
        for i, file in enumerate(files):
            source = (f"udpsrc port={7500 + i} do-timestamp=true socket-timestamp=disabled caps=application/x-test ! "
                      f"gdppay ! filesink buffer-mode=unbuffered location={file}")
            programs.append(self.start("--clock", "ptp", *source.split()))
        sender = ("import socket, time\ns = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\n"
                  "for i in range(150):\n"
                  "    for port in (7500, 7501): s.sendto(bytes([i]), ('127.0.0.1', port))\n"
                  "    time.sleep(0.1)\n")
        before = time.time()
        subprocess.run(STAGE.command(1, sys.executable, "-c", sender), check=True)
        after = time.time()
        for program in programs:
            program.send_signal(signal.SIGINT)
            self.assertEqual(program.wait(30), 0, program.stderr)
        # The last packets came to both.
        one, two = (times_in(file)[-50:] for file in files)
        self.assertEqual((len(one), len(two)), (50, 50))
        apart = sorted(abs(a - b) for a, b in zip(one, two))
        print(f"of 50 packets: {apart[25] / 1e3:.0f} us apart in the middle, {apart[-1] / 1e3:.0f} at most")
        self.assertLess(apart[25], 2e6)
        # Running time is PTP's, which the grandmaster has of this machine's, from the year 2020 on.
        self.assertGreater(one[0], 1e9 * (before - ZERO - 1))
        self.assertLess(one[-1], 1e9 * (after - ZERO + 1))

    def test_views_meet(self):
        # Three cameras and a server, each a program of its own that follows the same clock.
        cameras = [f"cam{i}" for i in range(3)]
        for i, camera in enumerate(cameras):
            self.start("--clock", "ptp", *f"""rigtestsrc camera={camera} is-live=true ! video/x-raw,framerate=10/1 !
                silhouette camera={camera} trigger-from=none ! viewencode ! gdppay !
                viewserversink host=127.0.0.1 port={7481 + i}""".split())
        figures = STAGE.folder / "hull.json"
        server = self.start("--clock", "ptp", "--json", str(figures), *" ".join(
            ["hullbuild name=hull max-wait=500000000 ! fakesink num-buffers=20"] +
            [f"viewclientsrc name={camera} camera={camera} port={7481 + i} ! queue ! viewdecode ! hull."
             for i, camera in enumerate(cameras)]).split())
        self.assertEqual(server.wait(50), 0, server.stderr)
        stats = json.loads(figures.read_text())["stats"]
        self.assertGreaterEqual(stats["hull"]["sets-by-capture-time"], 15)
        self.assertGreaterEqual(stats["hull"]["sets"], stats["hull"]["sets-incomplete"] + 10)
        self.assertLess(stats["hull"]["spread-median-us"], 8000)
        for camera in cameras:
            self.assertEqual(stats[camera]["frames-of-another-clock"], 0)

    def test_a_master_that_is_lost(self):
        global MASTER_PROGRAM
        program = self.start("--clock", "ptp", *"videotestsrc is-live=true ! fakesink".split())
        time.sleep(4)
        MASTER_PROGRAM.kill()
        self.said(program, "nothing has come of the clock of ptp for 5 s")
        MASTER_PROGRAM = STAGE.master()
        self.said(program, "the clock of ptp is there again")
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(30), 0)

    def test_nobody_there(self):
        for clock, words in (("ptp:77", "No PTP clock is heard in domain 77"), ("ptp:256", "ptp:DOMAIN"),
                             ("ptp:", "ptp:DOMAIN")):
            program = self.start("--clock", clock, "fakesrc", "num-buffers=1", "!", "fakesink")
            self.said(program, words)
            self.assertEqual(program.wait(30), 1)
        program = self.start("--clock", "ptp", "fakesrc", "num-buffers=1", "!", "fakesink",
                             env={**os.environ, "GST_PTP_HELPER": "/nowhere", "GST_PTP_HELPER_1_0": "/nowhere"})
        self.said(program, "gst-ptp-helper does not run here")
        self.assertEqual(program.wait(30), 1)


if __name__ == "__main__":
    missing = [name for name in ("ptp4l", "ip", "unshare", "nsenter") if shutil.which(name) is None]
    if missing:
        skip(f"{', '.join(missing)}: not there (apt-get install linuxptp iproute2)")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # leave nothing behind
    with tempfile.TemporaryDirectory() as temporary:
        try:
            STAGE = Stage(pathlib.Path(temporary))
        except (OSError, subprocess.CalledProcessError) as error:
            skip(f"no network namespaces: {error}")
        try:
            MASTER_PROGRAM = STAGE.master()
            if MASTER_PROGRAM is None:
                skip("ptp4l gives no clock here: " + (STAGE.folder / "master.log").read_text())
            unittest.main()
        finally:
            STAGE.close()
