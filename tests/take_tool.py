#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""polyhull-take on a take that a pipeline writes: what it tells, the texts, the exports, the rescue.

usage: take_tool.py POLYHULL_TAKE"""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1)
FRAMES = 6


def take(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120)


def read_glb(path):
    """A GLB's JSON and its binary."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data)), (magic, version, length, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    return json.loads(data[20:20 + size]), data[28 + size:]


def values(glb, binary, index):
    accessor = glb["accessors"][index]
    view = glb["bufferViews"][accessor["bufferView"]]
    count = accessor["count"] * {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
    return struct.unpack_from(f"<{count}f", binary, view.get("byteOffset", 0))


class Take(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.take = cls.folder / "dance.take"
        cls.rig = cls.folder / "stage.json"
        cls.rig.write_text('{ "some": "rig" }\n')
        cameras = " ".join(
            f"rigtestsrc camera=cam{i} num-buffers={FRAMES} ! video/x-raw,framerate=25/1 ! "
            f"silhouette camera=cam{i} ! tee name=c{i} ! queue ! t.sink_{i} c{i}. ! queue ! h." for i in range(3))
        line = (f"takesink name=t location={cls.take} rig={cls.rig} {cameras} "
                "hullbuild name=h ! hulltexture ! queue ! t.sink_9")
        subprocess.run(["gst-launch-1.0", "-q", *line.split()], check=True, timeout=120)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_info(self):
        result = take("info", self.take)
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = [line.split() for line in result.stdout.splitlines()]
        self.assertEqual([row[0] for row in rows], ["stream", "sink_0", "sink_1", "sink_2", "sink_9", "rig"])
        self.assertEqual(rows[1][1:7], ["view", "of", "cam0", "0.000", "0.240", str(FRAMES)])
        self.assertEqual(rows[4][1:5], ["mesh", "0.000", "0.240", str(FRAMES)])

    def test_packed_views(self):
        packed = self.folder / "packed.take"
        line = f"takesrc location={self.take} ! viewencode coding=lz4 ! takesink location={packed}"
        subprocess.run(["gst-launch-1.0", "-q", *line.split()], check=True, timeout=60)
        self.assertIn("view of cam0, packed", take("info", packed).stdout)

    def test_announcements_are_rescued(self):
        lines = self.folder / "lines.jsonl"
        lines.write_text("".join(json.dumps({
            "format": "polyhull-announcement", "version": 1, "scene": "", "lights": [], "exposure": 1,
            "ambient": [0, 0, 0], "stream_time_ns": 40_000_000 * i,
            "viewport": {"width": 32, "height": 24, "K": [30, 0, 15.5, 0, 30, 11.5, 0, 0, 1],
                         "R": [1, 0, 0, 0, -1, 0, 0, 0, -1], "t": [0, 1, 4 + i]}}) + "\n" for i in range(3)))
        announced, rescued = self.folder / "announced.take", self.folder / "announced-rescued.take"
        line = (f"videotestsrc num-buffers=5 ! video/x-raw,width=32,height=24,framerate=25/1 ! trackstamp name=s "
                f"scene-match=stream-time ! takesink location={announced} filesrc location={lines} ! s.scene")
        subprocess.run(["gst-launch-1.0", "-q", *line.split()], check=True, timeout=60)
        self.assertEqual(take("recover", announced, "-o", rescued).returncode, 0)
        for path in [announced, rescued]:
            self.assertIn("  3 announcements", take("info", path).stdout)

    def test_texts(self):
        self.assertEqual(take("extract", self.take, "rig").stdout, self.rig.read_text())
        missing = take("extract", self.take, "settings")
        self.assertEqual(missing.returncode, 1)
        self.assertIn("It keeps rig.", missing.stderr)

    def test_an_animation(self):
        output = self.folder / "dance.glb"
        result = take("export", self.take, "-o", output)
        self.assertEqual(result.returncode, 0, result.stderr)
        glb, binary = read_glb(output)
        hulls = [node for node in glb["nodes"] if node["name"] == "polyhull"]
        self.assertEqual(len(hulls), FRAMES)
        self.assertEqual([node.get("scale") for node in hulls], [None] + [[0, 0, 0]] * (FRAMES - 1))
        self.assertEqual(len({node["mesh"] for node in hulls}), FRAMES)
        animation, = glb["animations"]
        shown = {}
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            self.assertEqual((sampler["interpolation"], channel["target"]["path"]), ("STEP", "scale"))
            times, sizes = values(glb, binary, sampler["input"]), values(glb, binary, sampler["output"])
            self.assertEqual(len(sizes), 3 * len(times))
            shown[channel["target"]["node"]] = list(zip(times, sizes[::3]))
        # At any time one hull is seen.
        for frame in range(FRAMES):
            time = 0.04 * frame + 0.02
            seen = [node for node, keys in shown.items() if [size for when, size in keys if when <= time][-1:] == [1]]
            self.assertEqual([glb["nodes"].index(hulls[frame])], seen)
        self.assertGreaterEqual(len(glb["images"]), FRAMES)

    @unittest.skipUnless(shutil.which("blender"), "Blender is not installed")
    def test_blender_plays_the_animation(self):
        output = self.folder / "blender.glb"
        self.assertEqual(take("export", self.take, "-o", output).returncode, 0)
        # Debian 12's numpy has lost a name that its Blender's importer uses.
        script = self.folder / "play.py"
        script.write_text(f"""
import numpy
numpy.bool = bool
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath={str(output)!r})
bpy.context.scene.render.fps = 25
for frame in range({FRAMES}):
    bpy.context.scene.frame_set(frame)
    print("seen", frame, [o.name for o in bpy.data.objects if o.type == "MESH" and o.matrix_world.to_scale().x > 0.5])
""")
        # Its Python is the system's, whichever one runs this.
        result = subprocess.run(["blender", "-b", "-P", str(script)], capture_output=True, text=True, timeout=120,
                                env=dict(os.environ, PATH="/usr/bin:/bin"))
        seen = [line.split(" ", 2)[2] for line in result.stdout.splitlines() if line.startswith("seen ")]
        self.assertEqual(len(seen), FRAMES, result.stdout + result.stderr)
        self.assertEqual(len(set(seen)), FRAMES, seen)
        self.assertTrue(all(names.count("'") == 2 for names in seen), seen)

    def test_a_sequence(self):
        result = take("export", self.take, "-o", self.folder / "hull-%03d.ply", "--from", 0.08, "--to", 0.2, "--every", 2)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(sorted(path.name for path in self.folder.glob("hull-*.ply")), ["hull-000.ply", "hull-001.ply"])

    def test_what_is_no_mesh_is_left_out(self):
        mixed = self.folder / "mixed.take"
        mixed.write_bytes(self.take.read_bytes())
        rubbish = (f"fakesrc num-buffers=2 sizetype=fixed sizemax=100 filltype=zero ! "
                   f"application/x-polyhull-mesh ! t.sink_9 takesink name=t location={mixed} existing=append")
        subprocess.run(["gst-launch-1.0", "-q", *rubbish.split()], check=True, timeout=60)
        result = take("export", mixed, "-o", self.folder / "mixed.glb")
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertIn(f"{FRAMES} meshes written", result.stdout)
        self.assertIn("2 buffers are no meshes", result.stderr)
        self.assertIn("of the stream sink_9 is left out", result.stderr)

    def test_what_cannot_be_exported(self):
        for arguments, word in [(["-o", self.folder / "x.ply"], "numbered"),
                                (["-o", self.folder / "x.glb", "--stream", "sink_0"], "no meshes"),
                                (["-o", self.folder / "x.glb", "--from", 7], "no mesh from 7"),
                                (["-o", "/nowhere/x.glb"], "/nowhere/x.glb")]:
            result = take("export", self.take, *arguments)
            self.assertEqual(result.returncode, 1, arguments)
            self.assertIn(word, result.stderr)
        self.assertIn("No such file", take("info", self.folder / "none.take").stderr)
        self.assertIn("no take", take("info", self.rig).stderr)

    def test_a_damaged_take_is_rescued(self):
        damaged = self.folder / "damaged.take"
        data = bytearray(self.take.read_bytes())
        middle = len(data) // 2
        data[middle:middle + 50] = bytes(50)
        damaged.write_bytes(data)
        result = take("info", damaged)
        self.assertEqual(result.returncode, 1)
        self.assertIn("damaged", result.stdout)
        rescued = self.folder / "rescued.take"
        result = take("recover", damaged, "-o", rescued)
        self.assertEqual(result.returncode, 1, result.stderr)  # something was left out
        self.assertRegex(result.stdout, r"^2[0-3] buffers copied")
        result = take("info", rescued)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertEqual(take("extract", rescued, "rig").stdout, self.rig.read_text())
        self.assertIn("there already", take("recover", damaged, "-o", rescued).stderr)

    def test_whatever_page_is_gone_the_rest_is_rescued(self):
        sound = self.take.read_bytes()
        damaged, rescued = self.folder / "page.take", self.folder / "rescued_page.take"
        page = 32768
        places = list(range(page, len(sound), page))
        if "POLYHULL_LONG" not in os.environ:
            places = places[:3] + places[3::7] + places[-1:]
        for at in places:
            damaged.write_bytes(sound[:at] + b"\xa5" * min(page, len(sound) - at) + sound[at + page:])
            rescued.unlink(missing_ok=True)
            result = take("recover", damaged, "-o", rescued)
            self.assertIn(result.returncode, (0, 1), result.stderr)
            self.assertRegex(result.stdout, r"^\d+ buffers copied", result.stderr)


if __name__ == "__main__":
    unittest.main()
