#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""polyhull-run's latency: of pipelines whose elements take a known time; studio files set and saved.

usage: run_tool.py POLYHULL_RUN [Latency | Studio | SharedClock]"""
import json
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

PROGRAM = sys.argv.pop(1)


def run(pipeline, *options):
    """What polyhull-run prints, and its JSON."""
    with tempfile.TemporaryDirectory() as folder:
        figures = pathlib.Path(folder) / "figures.json"
        result = subprocess.run([PROGRAM, "--quiet", "--json", str(figures), *options, *pipeline.split()],
                                capture_output=True, text=True, timeout=60)
        if result.returncode != 0:
            raise AssertionError(result.stdout + result.stderr)
        return result.stdout, json.loads(figures.read_text())


def wait_until_it_takes(program, kind):
    """Waits until a started program has a handler for this signal."""
    for _ in range(200):
        time.sleep(0.1)
        status = pathlib.Path(f"/proc/{program.pid}/status").read_text()
        if int(re.search(r"SigCgt:\s*(\w+)", status).group(1), 16) >> (kind - 1) & 1:
            return


class Latency(unittest.TestCase):
    def check_sums(self, latency):
        self.assertLessEqual(latency["minimum_ms"], latency["median_ms"])
        self.assertLessEqual(latency["median_ms"], latency["maximum_ms"])
        parts = sum(latency["shares_ms"].values()) + latency["other_cameras_ms"]
        self.assertAlmostEqual(parts, latency["mean_ms"], 6)

    def test_each_element_has_its_share(self):
        # The slow one in a bin, whose pads are no element's.
        text, figures = run("""videotestsrc name=camera is-live=true num-buffers=25 !
            video/x-raw,width=32,height=32,framerate=25/1 ! queue name=before !
            ( identity name=slow sleep-time=10000 ) ! identity name=quick ! queue name=after !
            fakesink name=out""")
        latency = figures["latency"]
        self.assertEqual((latency["output"], latency["cameras"], latency["frames"]), ("out", ["camera"], 25))
        self.check_sums(latency)
        self.assertGreaterEqual(latency["minimum_ms"], 10.0)
        self.assertGreaterEqual(latency["shares_ms"]["slow"], 10.0)
        self.assertLess(latency["shares_ms"]["quick"], latency["shares_ms"]["slow"])
        self.assertIn("latency from camera to out, 25 frames:", text)
        self.assertRegex(text, r"\nslow +\d+\.\d+ ms +\d+\.\d %\n")

    def test_colours_are_printed_as_properties_take_them(self):
        text, figures = run("videotestsrc num-buffers=1 pattern=ball background-color=0xff1ebe3c ! "
                            "video/x-raw,format=RGBx ! chromamatte name=key ! fakesink")
        self.assertIn(" screen-colour=0x1ebe3c ", text)
        self.assertEqual(figures["stats"]["key"]["screen-colour"], 0x1ebe3c)

    def test_counted_at_an_element(self):
        _, figures = run("""videotestsrc name=camera is-live=true num-buffers=25 !
            video/x-raw,width=32,height=32,framerate=25/1 ! identity name=first sleep-time=5000 !
            identity name=second sleep-time=20000 ! fakesink""", "--count", "first")
        latency = figures["latency"]
        self.check_sums(latency)
        self.assertEqual(latency["output"], "first")
        self.assertNotIn("second", latency["shares_ms"])
        self.assertGreaterEqual(latency["minimum_ms"], 5.0)

    def test_cameras_of_one_instant(self):
        with tempfile.TemporaryDirectory() as folder:
            subject = pathlib.Path(folder) / "tetrahedron.obj"
            subject.write_text("v 0 0 0\nv .4 1 0\nv -.4 1 0\nv 0 1 .4\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n")
            camera = f"rigtestsrc is-live=true num-buffers=15 subject={subject} noise=0"
            _, figures = run(f"""hullbuild name=hull min-cameras=2 ! queue name=after ! fakesink name=out
                {camera} name=one camera=cam0 ! video/x-raw,framerate=10/1 ! queue ! silhouette camera=cam0 ! hull.
                {camera} name=two camera=cam1 delay=60000000 ! video/x-raw,framerate=10/1 ! queue !
                silhouette name=late camera=cam1 ! hull.""")
        latency = figures["latency"]
        self.check_sums(latency)
        self.assertEqual(latency["cameras"], ["one", "two"])
        self.assertGreaterEqual(latency["frames"], 8)
        # The second one's picture comes 60 ms after the first one's: nobody worked meanwhile.
        self.assertGreater(latency["other_cameras_ms"], 30.0)
        self.assertIn("late", latency["shares_ms"])
        self.assertLess(latency["shares_ms"]["hull"], 60.0)

    def test_a_background_alone_is_no_camera(self):
        _, figures = run("""videotestsrc num-buffers=5 ! video/x-raw,format=RGBA,width=32,height=32 !
            composite.background composite name=composite ! queue ! fakesink""")
        self.assertIsNone(figures["latency"])

    def test_without_times_there_is_none(self):
        text, figures = run("fakesrc num-buffers=5 sizetype=fixed ! fakesink")
        self.assertIsNone(figures["latency"])
        self.assertNotIn("latency from", text)


class Studio(unittest.TestCase):
    PIPELINE = "videotestsrc name=camera num-buffers=2 ! chromamatte name=key ! fakesink"

    def studio(self, elements, *options, pipeline=PIPELINE, version=1):
        """The result of a run with a studio file of these elements."""
        path = pathlib.Path(self.folder.name) / "studio.json"
        path.write_text(json.dumps({"format": "polyhull-studio", "version": version, "elements": elements}))
        return subprocess.run([PROGRAM, "--quiet", "--brief", "--studio", str(path), *options, *pipeline.split()],
                              capture_output=True, text=True, timeout=60)

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.saved = pathlib.Path(self.folder.name) / "saved.json"

    def test_set_and_saved_at_the_end(self):
        result = self.studio({"key": {"strength": 62}, "light": {"on": True}}, "--save-studio", str(self.saved))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("studio.json, elements.light: nothing in the pipeline takes it", result.stderr)
        self.assertEqual(json.loads(self.saved.read_text())["elements"],
                         {"key": {"strength": 62}, "light": {"on": True}})

    def test_saved_on_request(self):
        path = pathlib.Path(self.folder.name) / "live.json"
        path.write_text('{"format": "polyhull-studio", "version": 1, "elements": {"key": {"strength": 50}}}')
        before = path.stat().st_ino
        # One buffer, then a wait that only a signal ends.
        program = subprocess.Popen([PROGRAM, "--quiet", "--studio", str(path), "videotestsrc", "is-live=true", "!",
                                    "chromamatte", "name=key", "!", "fakesink"], stderr=subprocess.PIPE, text=True)
        try:
            wait_until_it_takes(program, signal.SIGUSR1)  # the handler is there once the pipeline is
            program.send_signal(signal.SIGUSR1)
            self.assertIn("settings saved to", program.stderr.readline())
        finally:
            program.kill()
            program.communicate()
        self.assertNotEqual(path.stat().st_ino, before)
        self.assertEqual(json.loads(path.read_text())["elements"], {"key": {"strength": 50}})

    def started(self, *arguments):
        """polyhull-run once its pipeline plays and it takes SIGINT."""
        program = subprocess.Popen([PROGRAM, "--quiet", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        wait_until_it_takes(program, signal.SIGINT)
        time.sleep(0.5)
        return program

    def test_saved_when_interrupted(self):
        figures, stream = (pathlib.Path(self.folder.name) / name for name in ("figures.json", "stream.mov"))
        program = self.started("--save-studio", str(self.saved), "--json", str(figures),
                               *"videotestsrc name=camera is-live=true ! videoconvert ! jpegenc ! qtmux !".split(),
                               "filesink", f"location={stream}")
        program.send_signal(signal.SIGINT)
        _, errors = program.communicate(timeout=30)
        self.assertEqual(program.returncode, 0, errors)
        self.assertEqual(json.loads(self.saved.read_text())["format"], "polyhull-studio")
        self.assertGreater(json.loads(figures.read_text())["frames"], 0)
        self.assertIn(b"moov", stream.read_bytes())  # which the muxer writes at the end of the stream

    def test_interrupted_twice(self):
        # What never lets the end of the stream through.
        program = self.started("--save-studio", str(self.saved),
                               *"videotestsrc is-live=true ! valve drop=true ! fakesink async=false".split())
        program.send_signal(signal.SIGINT)
        time.sleep(1.5)
        self.assertIsNone(program.poll())
        program.send_signal(signal.SIGINT)
        _, errors = program.communicate(timeout=30)
        self.assertEqual(program.returncode, 0, errors)
        self.assertTrue(self.saved.exists())

    def test_a_name_that_is_not_utf8(self):
        figures = pathlib.Path(self.folder.name) / "figures.json"
        result = subprocess.run([PROGRAM.encode(), b"--quiet", b"--save-studio", str(self.saved).encode(), b"--json",
                                 str(figures).encode(), b"filesrc", b"location=/dev/null", b"name=caf\xe9", b"!",
                                 b"fakesink"], capture_output=True, timeout=60)
        self.assertGreaterEqual(result.returncode, 0, result.stderr)  # refused or run, but no crash
        if result.returncode == 0:
            json.loads(figures.read_text())
            json.loads(self.saved.read_text())

    def test_figures_that_cannot_be_written(self):
        result = subprocess.run([PROGRAM, "--quiet", "--json", self.folder.name + "/no/where.json", "fakesrc",
                                 "num-buffers=1", "!", "fakesink"], capture_output=True, text=True, timeout=60)
        self.assertEqual(result.returncode, 1)
        self.assertIn("Cannot write", result.stderr)

    def test_refused(self):
        for elements, version, message in [
                ({"key": {"strength": "high"}}, 1, 'elements.key.strength: is "high"; expected a whole number from 0 to 255'),
                ({"key": {"strenght": 1}}, 1, "elements.key.strenght: chromamatte has no such property"),
                ({}, 7, '"version" is 7; this program reads version 1')]:
            result = self.studio(elements, version=version)
            self.assertEqual(result.returncode, 1, result.stdout)
            self.assertIn(message, result.stderr)
        result = self.studio({}, "--save-studio", self.folder.name + "/no/where.json")
        self.assertEqual(result.returncode, 1)
        self.assertIn("Cannot write", result.stderr)


class TimeServer:
    """A clock that is far from this machine's: GStreamer's packets are two times."""

    def __init__(self, ahead):
        self.ahead, self.silent = ahead, False
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        while True:
            packet, sender = self.socket.recvfrom(64)
            if len(packet) != 16:
                return
            if not self.silent:
                self.socket.sendto(packet[:8] + struct.pack(">Q", time.monotonic_ns() + self.ahead), sender)

    def close(self):
        self.socket.sendto(b"end", ("127.0.0.1", self.port))
        self.thread.join(10)
        self.socket.close()


class SharedClock(unittest.TestCase):
    LINE = "rigtestsrc is-live=true num-buffers=3 ! silhouette ! gdppay ! filesink location="

    def first_time(self, path):
        """Seconds, of the first buffer in gdppay's packets."""
        data, at = path.read_bytes(), 0
        while at < len(data):
            kind, size, pts = struct.unpack(">HIQ", data[at + 4:at + 18])
            if kind == 1:
                return pts * 1e-9
            at += 62 + size
        self.fail("no buffer was written")

    def test_running_time_is_the_servers_clock(self):
        server = TimeServer(5_000_000_000_000)
        self.addCleanup(server.close)
        with tempfile.TemporaryDirectory() as folder:
            views = pathlib.Path(folder) / "views.gdp"
            before = time.monotonic_ns()
            run(self.LINE + str(views), "--clock", f"127.0.0.1:{server.port}")
            after = time.monotonic_ns()
            first = self.first_time(views)
        self.assertGreater(first, 1e-9 * (before + server.ahead) - 1.0)
        self.assertLess(first, 1e-9 * (after + server.ahead) + 1.0)

    def follower(self, server, *options):
        """polyhull-run that follows the server's clock, once it plays."""
        program = subprocess.Popen([PROGRAM, "--quiet", "--brief", "--clock", f"127.0.0.1:{server.port}", *options,
                                    *"videotestsrc is-live=true ! fakesink".split()], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True)
        watchdog = threading.Timer(30, program.kill)
        watchdog.start()
        self.addCleanup(watchdog.cancel)
        self.addCleanup(program.communicate)
        self.addCleanup(program.kill)
        wait_until_it_takes(program, signal.SIGINT)  # which it does once it plays
        time.sleep(1)
        return program

    def said(self, program, words):
        """Reads what it says until these words come; the lines before and this one."""
        lines = []
        while True:
            line = program.stderr.readline()
            self.assertTrue(line, f"'{words}' is not in {lines}")
            lines.append(line)
            if words in line:
                return lines

    def test_a_clock_that_is_lost(self):
        server = TimeServer(5_000_000_000_000)
        self.addCleanup(server.close)
        with tempfile.TemporaryDirectory() as folder:
            figures = pathlib.Path(folder) / "figures.json"
            program = self.follower(server, "--json", str(figures))
            server.silent = True
            self.said(program, f"nothing has come of the clock of 127.0.0.1:{server.port} for 5 s")
            time.sleep(3)
            server.silent = False
            self.assertEqual(len([line for line in self.said(program, "is there again") if line.strip()]), 1)
            program.send_signal(signal.SIGINT)
            self.assertEqual(program.wait(60), 0)
            self.assertEqual(json.loads(figures.read_text())["clock_losses"], 1)

    def test_a_clock_that_begins_again(self):
        # At once, as when its program is another's; and after a silence, as when its machine starts again.
        for silence in (0, 7):
            server = TimeServer(5_000_000_000_000)
            self.addCleanup(server.close)
            program = self.follower(server)
            server.silent = silence > 0
            time.sleep(silence)
            server.ahead, server.silent = 0, False
            began = time.monotonic()
            self.said(program, "is another one than it was")
            self.assertEqual(program.wait(60), 1)
            self.assertLess(time.monotonic() - began, 20)

    def test_gives_its_clock(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.bind(("127.0.0.1", 0))
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
                free.bind(("127.0.0.1", 0))
                port = free.getsockname()[1]
            program = subprocess.Popen([PROGRAM, "--quiet", "--brief", "--clock-server", str(port),
                                        "videotestsrc", "is-live=true", "!", "fakesink"], stdout=subprocess.DEVNULL)
            try:
                client.settimeout(0.2)
                for _ in range(200):
                    self.assertIsNone(program.poll())
                    asked = time.monotonic_ns()
                    client.sendto(struct.pack(">QQ", asked, 0), ("127.0.0.1", port))
                    try:
                        reply = client.recv(64)
                        break
                    except (socket.timeout, ConnectionError):
                        time.sleep(0.1)
                echoed, told = struct.unpack(">QQ", reply)
                answered = time.monotonic_ns()
                second = subprocess.run([PROGRAM, "--clock-server", str(port), "videotestsrc", "num-buffers=1", "!",
                                         "fakesink"], capture_output=True, text=True, timeout=60)
                self.assertNotEqual(second.returncode, 0)
                self.assertIn("it is taken", second.stderr + second.stdout)
            finally:
                program.send_signal(signal.SIGINT)
                self.assertEqual(program.wait(60), 0)
            self.assertTrue(asked <= told <= answered, (asked, told, answered))
            self.assertLessEqual(echoed, asked)

    def test_refusals(self):
        taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(taken.close)
        taken.bind(("0.0.0.0", 0))
        for options, words in ((["--clock-server", str(taken.getsockname()[1])], "it is taken"),
                               (["--clock", "nowhere"], "expected HOST:PORT"),
                               (["--clock", "host:99999"], "expected HOST:PORT"),
                               (["--clock", "127.0.0.1:9"], "does not answer"),
                               (["--clock", "ptp:256"], "ptp:DOMAIN"),
                               (["--clock", "a:1", "--clock-server", "2"], "excludes")):
            result = subprocess.run([PROGRAM, *options, "videotestsrc", "num-buffers=1", "!", "fakesink"],
                                    capture_output=True, text=True, timeout=60)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(words, result.stderr + result.stdout)


if __name__ == "__main__":
    unittest.main()
