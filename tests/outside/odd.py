# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run inside Blender, after stage.py: the same scene as outside.py wants it where it is odd. Rows that are
no multiple of four bytes, a size in per cent, another run's rest, a collection that is not rendered, a
colour that changes, instances that move, a compositor that is switched off, a view layer that is not
rendered, 12.5 frames a second; and the rate that render_scene.py finds for others."""
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
# Of what is there only as instances, a collection's moves in frame 4, and in 5 particles carry two more.
props = bpy.data.collections.new("props")
props.objects.link(bpy.data.objects.new("prop", bpy.data.meshes["Cube"]))
place = bpy.data.objects.new("place", None)
place.instance_type, place.instance_collection = "COLLECTION", props
place.scale = (0.2, 0.2, 0.2)
for frame, height in ((1, 2.2), (3, 2.2), (4, 2.5)):
    place.location = (0, 2, height)
    place.keyframe_insert("location", frame=frame)
emitter = bpy.data.objects.new("emitter", bpy.data.meshes["Plane"])
emitter.location, emitter.scale = (0, 2, 2), (0.05, 0.05, 0.05)
for item in (place, emitter):
    scene.collection.objects.link(item)
emitter.modifiers.new("particles", "PARTICLE_SYSTEM")
particles = emitter.particle_systems[0].settings
particles.count, particles.frame_start, particles.frame_end = 2, 5, 5
particles.render_type, particles.instance_object = "OBJECT", props.objects["prop"]
particles.physics_type = "NO"
# A compositor that is switched off would invert the picture. The first view layer is not rendered.
scene.use_nodes = True
nodes = scene.node_tree.nodes
invert = nodes.new("CompositorNodeInvert")
scene.node_tree.links.new(nodes["Render Layers"].outputs["Image"], invert.inputs["Color"])
scene.node_tree.links.new(invert.outputs["Color"], nodes["Composite"].inputs["Image"])
scene.use_nodes = False
scene.view_layers.new("rendered")
scene.view_layers[0].use = False
(folder / "depth-0007.exr").write_bytes(b"left by a crash")
