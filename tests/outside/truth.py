# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run inside Blender after stage.py, with SUBJECT.glb FOLDER after "--": what Blender itself draws with the
subject. FOLDER/mask-N.png: the share of each pixel that shows it; FOLDER/lit-N.png: it in the light."""
import sys

import bpy
import numpy

numpy.bool = bool  # the importer's, gone from Debian 12's
subject_file, folder = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
stage = list(scene.objects)
bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
bpy.ops.import_scene.gltf(filepath=subject_file)
scene.view_settings.view_transform = "Standard"
scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
scene.render.dither_intensity = 0
scene.render.image_settings.file_format = "PNG"
scene.cycles.pixel_filter_type = "BOX"  # one pixel wide: what is seen in it, and nothing else
scene.cycles.filter_width = 1


def render(name, samples):
    scene.cycles.samples = samples
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        scene.render.filepath = f"{folder}/{name}-{frame}.png"
        bpy.ops.render.render(write_still=True)


scene.render.image_settings.color_mode = "RGB"
render("lit", 16)
scene.render.image_settings.color_mode = "RGBA"
scene.render.film_transparent = True
scene.cycles.max_bounces = 0
for item in stage:
    item.is_holdout = item.type == "MESH"
    item.hide_render = item.type == "LIGHT"
render("mask", 64)
