#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""polyhull-run's latency: of pipelines whose elements take a known time.

usage: run_tool.py POLYHULL_RUN"""
import json
import pathlib
import subprocess
import sys
import tempfile
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


if __name__ == "__main__":
    unittest.main()
