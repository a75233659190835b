# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run inside Blender: the scene of outside.py. A floor, a wall and a box before the subject, a lamp, a
camera whose lens is shifted. Frame 2: the lamp moves; 3: the box does, and the camera."""
import math

import bpy


def matt(name, colour):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = 1
    shader.inputs["Specular"].default_value = 0
    return material


def key(item, frame, place):
    item.location = place
    item.keyframe_insert("location", frame=frame)
    for curve in item.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "CONSTANT"


def add(name, data):
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    return item


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
bpy.ops.mesh.primitive_plane_add(size=8)
bpy.context.object.data.materials.append(matt("floor", (0.6, 0.6, 0.55)))
bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 2.6, 1.5))
bpy.context.object.scale = (8, 0.2, 3)
bpy.context.object.data.materials.append(matt("wall", (0.3, 0.45, 0.6)))
bpy.ops.mesh.primitive_cube_add(size=0.5)
box = bpy.context.object
box.data.materials.append(matt("box", (0.7, 0.3, 0.1)))
for frame, place in ((1, (0.3, -0.8, 0.25)), (3, (-0.25, -0.9, 0.25))):
    key(box, frame, place)

lamp = add("lamp", bpy.data.lights.new("lamp", "AREA"))
lamp.data.energy, lamp.data.shape, lamp.data.size, lamp.data.size_y = 110, "RECTANGLE", 0.4, 0.3
lamp.rotation_euler = (0.1, 0.2, 0)
for frame, place in ((1, (1.4, -0.6, 3.2)), (2, (-1.6, -0.3, 3.2))):
    key(lamp, frame, place)

camera = add("camera", bpy.data.cameras.new("camera"))
camera.data.lens = 30
camera.data.shift_x, camera.data.shift_y = 0.12, -0.08
camera.rotation_euler = (math.radians(83), math.radians(2), math.radians(7))
for frame, place in ((1, (0.9, -4.2, 1.4)), (3, (1.1, -4.0, 1.3))):
    key(camera, frame, place)
scene.camera = camera
scene.world = bpy.data.worlds.new("world")
scene.world.color = (0.05, 0.05, 0.05)
scene.render.engine = "CYCLES"
scene.render.resolution_x, scene.render.resolution_y = 362, 214
scene.render.pixel_aspect_y = 1.25
scene.cycles.seed = 1
scene.render.fps = 25
scene.frame_start, scene.frame_end = 1, 3
