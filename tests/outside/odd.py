# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run inside Blender, after stage.py: the same scene as outside.py wants it where it is odd. Rows that are
no multiple of four bytes, a size in per cent, another run's rest, 12.5 frames a second; and the rate that
render_scene.py finds for others."""
import json
import pathlib
import runpy
import sys

import bpy

folder = pathlib.Path(sys.argv[sys.argv.index("--") + 1])
script = runpy.run_path(str(pathlib.Path(__file__).parents[2] / "pipelines" / "blender" / "render_scene.py"))
scene = bpy.context.scene
found = []
for fps, base in ((24, 1), (25, 1), (30, 1.001), (24, 1.001), (60, 1.001), (25, 2), (100, 3), (1, 4)):
    scene.render.fps, scene.render.fps_base = fps, base
    rate = script["frame_rate"](scene.render.fps, scene.render.fps_base)
    found.append([rate.numerator, rate.denominator])
(folder / "rates.json").write_text(json.dumps(found))
scene.render.fps, scene.render.fps_base = 25, 2
# 58 % of 50 is 28.999... in floating point; Blender renders 29 x 29.
scene.render.resolution_x = scene.render.resolution_y = 50
scene.render.resolution_percentage = 58
(folder / "depth-0007.exr").write_bytes(b"left by a crash")
