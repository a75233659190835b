# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run inside Blender, after stage.py: the same scene as outside.py wants it where it is odd. Rows that are
no multiple of four bytes, a size in per cent, another run's rest, a collection that is not rendered, a
colour that changes, an instance that moves, nodes that are switched off, 12.5 frames a second; and the rate that render_scene.py finds for others."""
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
# A lamp and a wall that are not rendered, two collections deep.
off, within = bpy.data.collections.new("off"), bpy.data.collections.new("within")
scene.collection.children.link(off)
off.children.link(within)
off.hide_render = True
lamp = bpy.data.objects.new("unlit", bpy.data.lights.new("unlit", "POINT"))
lamp.data.energy = 10000
within.objects.link(lamp)
within.objects.link(bpy.data.objects.new("unseen", bpy.data.meshes["Cube"]))
# The box changes its colour in frame 2, while nothing solid moves; in frame 3 it moves.
colour = bpy.data.materials["box"].node_tree.nodes["Principled BSDF"].inputs["Base Color"]
for frame, value in ((1, (0.7, 0.3, 0.1, 1)), (2, (0.1, 0.3, 0.7, 1))):
    colour.default_value = value
    colour.keyframe_insert("default_value", frame=frame)
# A collection that is not in the scene has an instance there, which moves in frame 4.
prop = bpy.data.collections.new("prop")
prop.objects.link(bpy.data.objects.new("part", bpy.data.meshes["Cube"]))
instance = bpy.data.objects.new("instance", None)
instance.instance_type, instance.instance_collection = "COLLECTION", prop
scene.collection.objects.link(instance)
for frame, place in ((1, (2.5, 1, 0.5)), (4, (2.8, 1, 0.5))):
    instance.location = place
    instance.keyframe_insert("location", frame=frame)
for curve in instance.animation_data.action.fcurves:
    for point in curve.keyframe_points:
        point.interpolation = "CONSTANT"
# Nodes that would turn the picture's colours round, if they were on.
scene.use_nodes = True
tree = scene.node_tree
invert = tree.nodes.new("CompositorNodeInvert")
tree.links.new(tree.nodes["Render Layers"].outputs["Image"], invert.inputs["Color"])
tree.links.new(invert.outputs["Color"], tree.nodes["Composite"].inputs["Image"])
scene.use_nodes = False
(folder / "depth-0007.exr").write_bytes(b"left by a crash")
