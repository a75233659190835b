#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""A subject in Blender's scene: render_scene.py renders three frames and announces them, composite draws a
hull into them, and Blender renders the same hull itself. Both pictures show it in one place; lamp and box
move when Blender moves them."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy

SOURCE = pathlib.Path(os.environ["POLYHULL_SOURCE"])
HERE = SOURCE / "tests" / "outside"
WIDTH, HEIGHT, FRAMES = 362, 214, 3
HULL = " ".join(f"rigtestsrc camera=cam{i} num-buffers=1 ! silhouette camera=cam{i} ! h." for i in range(4)) + \
    " hullbuild name=h"


def blender(*arguments):
    # Its Python is the system's, whichever one runs this.
    result = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", *map(str, arguments)],
                            capture_output=True, text=True, timeout=600, env=dict(os.environ, PATH="/usr/bin:/bin"))
    if result.returncode != 0:
        raise AssertionError(result.stdout[-3000:] + result.stderr[-3000:])
    return result.stdout


def launch(line):
    subprocess.run(["gst-launch-1.0", "-q", *line.split()], check=True, timeout=300)


def linear(values):
    values = values / 255.0
    return numpy.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def pictures(path):
    return numpy.fromfile(path, dtype=numpy.uint8).reshape(-1, HEIGHT, WIDTH, 4)


def edges(coverage):
    """Where a row's only run of the subject begins and ends, in fractions of a pixel, by row."""
    found = {}
    for y, row in enumerate(coverage):
        seen, whole = numpy.flatnonzero(row > 0.01), numpy.flatnonzero(row > 0.99)
        if len(whole) < 4 or len(whole) != whole[-1] - whole[0] + 1 or len(seen) != seen[-1] - seen[0] + 1:
            continue
        found[y] = numpy.array([whole[0] - row[seen[0]:whole[0]].sum(), whole[-1] + row[whole[-1] + 1:].sum()])
    return found


def centroid(weights):
    y, x = numpy.mgrid[:HEIGHT, :WIDTH]
    return numpy.array([(x * weights).sum(), (y * weights).sum()]) / weights.sum()


def spread(values, radius):
    kernel = numpy.ones(2 * radius + 1) / (2 * radius + 1)
    for axis in (0, 1):
        values = numpy.apply_along_axis(lambda line: numpy.convolve(line, kernel, "same"), axis, values)
    return values


@unittest.skipUnless(shutil.which("blender"), "Blender is not installed")
class Outside(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        blender("-P", HERE / "stage.py", "-P", SOURCE / "pipelines" / "blender" / "render_scene.py", "--",
                cls.folder, "--samples", 16, "--depth", 0.5)
        launch(f"{HULL} ! hullexport location={cls.folder}/subject.glb")
        blender("-P", HERE / "stage.py", "-P", HERE / "truth.py", "--", cls.folder / "subject.glb", cls.folder)
        cls.frames = cls.read("frames/%04d.png")[..., :3].mean(3)
        cls.lit = cls.read("lit-%d.png")[..., :3].mean(3)
        cls.mask = cls.read("mask-%d.png", linearly=False)[..., 3] / 255.0

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def read(cls, name, linearly=True):
        launch(f"multifilesrc location={cls.folder}/{name} start-index=1 stop-index={FRAMES} caps=image/png ! pngdec ! "
               f"videoconvert ! video/x-raw,format=RGBA ! filesink location={cls.folder}/read.raw")
        read = pictures(cls.folder / "read.raw")
        assert len(read) == FRAMES, (name, len(read))
        return linear(read) if linearly else read.astype(float)

    def composite(self, background, mesh="", settings="", matched="", messages="announcements.jsonl", depth=""):
        launch(f"{HULL} ! {mesh} c.mesh_0 {background} ! video/x-raw,format=RGBA ! timecodestamper ! "
               f"trackstamp name=t {matched} ! c.background filesrc location={self.folder}/{messages} ! "
               f"t.scene {depth} composite name=c backend=processor {settings} ! video/x-raw,format=RGBA ! "
               f"filesink location={self.folder}/composite.raw")
        made = pictures(self.folder / "composite.raw")
        self.assertEqual(len(made), FRAMES)
        return linear(made[..., :3]).mean(3)

    def rendered(self, matched=""):
        return self.composite(f"multifilesrc location={self.folder}/frames/%04d.png start-index=1 stop-index={FRAMES} "
                              "caps=image/png,framerate=25/1 ! pngdec ! videoconvert", "hulltexture !", matched=matched)

    def coverage(self, **others):
        """Before black, the grey hull is its own coverage."""
        drawn = self.composite(f"videotestsrc pattern=black num-buffers={FRAMES} ! "
                               f"video/x-raw,width={WIDTH},height={HEIGHT},framerate=25/1 ! videoconvert",
                               settings="edge-samples=8", **others)
        return [frame / numpy.median(frame[frame > 0.01]) for frame in drawn]

    def test_register(self):
        drawn = self.coverage()
        for frame in range(FRAMES):
            ours, truth = drawn[frame], self.mask[frame]
            shift = centroid(ours) - centroid(truth)
            print(f"frame {frame + 1}: centroid {shift.round(4)} px, area {ours.sum() / truth.sum() - 1:+.3%}")
            self.assertLess(abs(shift).max(), 0.05)
            self.assertLess(abs(ours.sum() / truth.sum() - 1), 0.005)
            for axis, of_ours, of_truth in (("x", edges(ours), edges(truth)), ("y", edges(ours.T), edges(truth.T))):
                common = sorted(of_ours.keys() & of_truth.keys())
                self.assertGreater(len(common), 8)
                apart = numpy.array([of_ours[k] - of_truth[k] for k in common])
                print(f"  {axis}: {2 * len(common)} edges, mean {apart.mean(0).round(4)}, "
                      f"rms {numpy.sqrt((apart ** 2).mean()):.3f}, largest {abs(apart).max():.2f} px")
                self.assertLess(abs(apart.mean(0)).max(), 0.1)
                self.assertLess(numpy.sqrt((apart ** 2).mean()), 0.2)

    def test_depth(self):
        """Without the scene's geometry, Blender's depth hides what it hides."""
        lines = [json.loads(line) for line in (self.folder / "announcements.jsonl").read_text().splitlines()]
        (self.folder / "no-scene.jsonl").write_text("".join(json.dumps(dict(line, scene="")) + "\n" for line in lines))
        depth = (f"filesrc location={self.folder}/depth.gray16 ! rawvideoparse format=gray16-le width={WIDTH} "
                 f"height={HEIGHT} framerate=25/1 ! timecodestamper ! t.depth")
        for name, drawn, hidden in (("depth alone", self.coverage(messages="no-scene.jsonl", depth=depth), True),
                                    ("depth and scene", self.coverage(depth=depth), True),
                                    ("neither", self.coverage(messages="no-scene.jsonl"), False)):
            for frame in range(FRAMES):
                ours, truth = drawn[frame], self.mask[frame]
                shift, more = centroid(ours) - centroid(truth), ours.sum() / truth.sum() - 1
                print(f"{name}, frame {frame + 1}: centroid {shift.round(3)} px, area {more:+.2%}")
                if hidden:
                    self.assertLess(abs(shift).max(), 0.3)
                    self.assertLess(abs(more), 0.02)
                else:
                    self.assertGreater(more, 0.03)

    def shadow(self, pictures_with, frame):
        """Where the floor is darker than without the subject, away from it."""
        floor = numpy.zeros((HEIGHT, WIDTH), dtype=bool)
        floor[HEIGHT // 2:] = True
        floor &= spread(self.mask[frame], 3) < 1e-9
        return numpy.where(floor, spread(self.frames[frame] - pictures_with[frame], 2), 0) > 0.03

    def test_lamp_moves_with_the_frame(self):
        ours = self.rendered()
        delayed = self.rendered("scene-delay=40000000")
        for frame in range(FRAMES):
            mine, truth = self.shadow(ours, frame), self.shadow(self.lit, frame)
            overlap = (mine & truth).sum() / (mine | truth).sum()
            apart = centroid(mine) - centroid(truth)
            print(f"frame {frame + 1}: shadows overlap {overlap:.2f}, centroids {apart.round(2)} px apart")
            self.assertGreater(overlap, 0.6)
            self.assertLess(abs(apart).max(), 8)
        # The lamp has moved in the second frame; a frame too late is seen.
        late, truth = self.shadow(delayed, 1), self.shadow(self.lit, 1)
        self.assertLess((late & truth).sum() / (late | truth).sum(), 0.2)

    def test_brightness(self):
        """The shadow takes away the light that Blender's lamp gives, in Blender's watts."""
        ours = self.rendered()
        for frame in range(FRAMES):
            core = self.shadow(ours, frame) & self.shadow(self.lit, frame)
            share = (self.frames - ours)[frame][core].sum() / (self.frames - self.lit)[frame][core].sum()
            print(f"frame {frame + 1}: the shadow takes {share:.2f} of what Blender's takes")
            self.assertGreater(share, 0.7)
            self.assertLess(share, 1.3)


@unittest.skipUnless(shutil.which("blender"), "Blender is not installed")
class Odd(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.said = cls.render(cls.folder, "--depth", 0.5, "--frames", "1-6")
        cls.lines = [json.loads(line) for line in (cls.folder / "announcements.jsonl").read_text().splitlines()]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @staticmethod
    def render(folder, *options):
        return blender("-P", HERE / "stage.py", "-P", HERE / "odd.py",
                       "-P", SOURCE / "pipelines" / "blender" / "render_scene.py", "--",
                       folder, "--samples", 1, *options)

    def test_rates(self):
        self.assertEqual(json.loads((self.folder / "rates.json").read_text()),
                         [[24, 1], [25, 1], [30000, 1001], [24000, 1001], [60000, 1001], [25, 2], [100, 3], [1, 4]])
        self.assertEqual([line["timecode_rate"] for line in self.lines], 6 * [[25, 2]])
        self.assertEqual([line["stream_time_ns"] for line in self.lines], [80_000_000 * i for i in range(6)])

    def test_size(self):
        """The size that Blender rendered; an odd one's depth is read row by row."""
        header = (self.folder / "frames" / "0001.png").read_bytes()[16:24]
        size = [int.from_bytes(header[:4], "big"), int.from_bytes(header[4:], "big")]
        self.assertEqual(size, [29, 29])
        for line in self.lines:
            self.assertEqual([line["viewport"]["width"], line["viewport"]["height"]], size)
        launch(f"filesrc location={self.folder}/depth.gray16 ! rawvideoparse format=gray16-le width={size[0]} "
               f"height={size[1]} ! video/x-raw,format=GRAY16_LE ! videoconvert ! "
               f"video/x-raw,format=GRAY16_BE ! filesink location={self.folder}/read.raw")
        read = numpy.fromfile(self.folder / "read.raw", dtype=">u2")
        depth = read.reshape(len(self.lines), size[1], size[0] + 1)[:, :, :size[0]]
        self.assertEqual(len(depth), 6)
        # The floor's 1/z is linear over the picture.
        floor = depth[:, 24:].astype(int)
        self.assertGreater(floor.min(), 0)
        for axis in (1, 2):
            self.assertLess(abs(numpy.diff(floor, 2, axis)).max(), 3)

    def test_without_depth(self):
        """Writing the depth does not change the picture."""
        without = self.folder / "without"
        without.mkdir()
        self.render(without, "--frames", "1-1")
        read = []
        for folder in (self.folder, without):
            launch(f"filesrc location={folder}/frames/0001.png ! pngdec ! filesink location={self.folder}/picture.raw")
            read.append((self.folder / "picture.raw").read_bytes())
        self.assertEqual(*read)

    def scene(self, number):
        """The JSON of a frame's GLB."""
        data = (self.folder / f"scene-{number:04}.glb").read_bytes()
        return json.loads(data[20:20 + int.from_bytes(data[12:16], "little")])

    def test_pipeline(self):
        """The printed line runs, at the scene's rate."""
        lines = [line.strip() for line in self.said.splitlines()]
        command, = (line for line in lines if line.startswith("gst-launch-1.0 "))
        self.assertEqual(command.count("framerate=25/2"), 2)
        run = subprocess.run([*command.split(), *"name=mix ! video/x-raw,framerate=25/2 ! filesink".split(),
                              f"location={self.folder}/printed.raw"], timeout=300, capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual((self.folder / "printed.raw").stat().st_size, 6 * 29 * 29 * 4)

    def test_collections(self):
        """What is not rendered is neither announced nor exported."""
        for line in self.lines:
            self.assertEqual([light["name"] for light in line["lights"]], ["lamp"])
        names = [node["name"] for node in self.scene(1)["nodes"]]
        self.assertIn("Plane", names)
        self.assertNotIn("unseen", names)
        self.assertNotIn("unlit", names)

    def test_scenes(self):
        """A scene of its own for each frame in which something is otherwise, but for no other."""
        self.assertEqual([pathlib.Path(line["scene"]).name for line in self.lines],
                         [f"scene-{number:04}.glb" for number in (1, 2, 3, 4, 5, 5)])

    def test_colour(self):
        for number, expected in ((1, (0.7, 0.3, 0.1, 1)), (2, (0.1, 0.3, 0.7, 1))):
            box, = (found for found in self.scene(number)["materials"] if found["name"] == "box")
            for found, wanted in zip(box["pbrMetallicRoughness"]["baseColorFactor"], expected, strict=True):
                self.assertAlmostEqual(found, wanted, places=5)

    def test_instances(self):
        """The scene has what only a collection's instance or particles show, where they show it."""
        def props(number):
            nodes = self.scene(number)["nodes"]
            return {node["name"]: sum(nodes[child]["name"].startswith("prop") for child in node.get("children", []))
                    for node in nodes if node["name"] in ("place", "emitter")}
        for number, carried in ((3, 0), (4, 0), (5, 2)):
            self.assertEqual(props(number), {"place": 1, "emitter": carried})
        for number, height in ((3, 2.2), (4, 2.5)):
            place, = (node for node in self.scene(number)["nodes"] if node["name"] == "place")
            self.assertAlmostEqual(place["translation"][1], height, places=5)


if __name__ == "__main__":
    unittest.main()
