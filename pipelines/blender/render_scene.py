# SPDX-License-Identifier: LGPL-2.1-or-later
"""Run inside Blender 3.4 or later: renders a scene's frames as PNG, exports the scene as GLB whenever it
changes, and writes with each frame what composite must know of it: camera, lights, scene.

    blender -b stage.blend --python pipelines/blender/render_scene.py -- FOLDER [--frames 1-50]

FOLDER then holds frames/0001.png ..., scene-0001.glb ... and announcements.jsonl, and with --depth
depth.gray16, raw frames of 16-bit grey; see docs/outside-renderers.md for the pipeline that composites
with them.
"""
import argparse
import hashlib
import json
import math
import pathlib
import socket
import sys
from fractions import Fraction

import _cycles
import bpy
import numpy

# Debian 12's numpy has lost a name that its Blender's glTF add-on uses.
if "bool" not in vars(numpy):
    numpy.bool = bool

# Blender's world is z up, glTF's y up: what the exporter makes of it.
TO_GLTF = numpy.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=float)
FAR_AWAY = 1000.0  # metres, to the sun


def place(matrix):
    return TO_GLTF @ numpy.array(matrix.translation, dtype=float)


def axes(matrix):
    """The object's own x, y and z in glTF's world as columns, orthonormal in double precision."""
    u, _, v = numpy.linalg.svd(TO_GLTF @ numpy.array(matrix.to_3x3().normalized(), dtype=float))
    return u @ v


def size_of(scene):
    """In pixels, rounded down in whole numbers as Blender does."""
    percentage = scene.render.resolution_percentage
    return scene.render.resolution_x * percentage // 100, scene.render.resolution_y * percentage // 100


def frame_rate(fps, fps_base):
    """Frames a second as a fraction. Blender keeps fps / fps_base, the base in single precision."""
    if abs(fps_base - 1.001) < 1e-5:  # as NTSC has it
        return Fraction(fps * 1000, 1001)
    return Fraction(fps / round(fps_base, 4)).limit_denominator(1000)


def viewport(scene, depsgraph):
    """The camera as docs/formats.md has it. Its lens is what Blender itself projects with: shift, sensor
    fit and pixel aspect are in it. Pixel (0, 0) is the centre of the upper left one."""
    if scene.camera is None or scene.camera.data.type != "PERSP":
        sys.exit("render_scene.py: the scene needs a camera with perspective; others cannot be announced.")
    width, height = size_of(scene)
    camera = scene.camera.evaluated_get(depsgraph)
    lens = numpy.array(camera.calc_matrix_camera(
        depsgraph, x=width, y=height, scale_x=scene.render.pixel_aspect_x,
        scale_y=scene.render.pixel_aspect_y), dtype=float)
    right, up, back = axes(camera.matrix_world).T
    rotation = numpy.array([right, -up, -back])
    return {"name": camera.name, "width": width, "height": height,
            "K": [lens[0, 0] * width / 2, 0, (1 - lens[0, 2]) * width / 2 - 0.5,
                  0, lens[1, 1] * height / 2, (1 + lens[1, 2]) * height / 2 - 0.5, 0, 0, 1],
            "R": rotation.flatten().tolist(), "t": (-rotation @ place(camera.matrix_world)).tolist()}


def light(item):
    """A lamp as a parallelogram or a point. Blender's watts as Cycles takes them: the radiance of an area
    light is its power through four times its area, the intensity of a point its power through 4 pi."""
    data, turn, centre = item.data, axes(item.matrix_world), place(item.matrix_world)
    scale = numpy.array(item.matrix_world.to_scale(), dtype=float)
    colour = data.energy * numpy.array(data.color, dtype=float)
    half, cone = numpy.zeros(2), {}
    if data.type == "AREA":
        half = 0.5 * data.size * numpy.abs(scale[:2])
        if data.shape in ("RECTANGLE", "ELLIPSE"):
            half[1] = 0.5 * data.size_y * abs(scale[1])
        if data.shape in ("DISK", "ELLIPSE"):  # as a rectangle of the same area
            half *= math.sqrt(math.pi) / 2
        colour = colour / (16 * half[0] * half[1])
    elif data.type == "SPOT":
        outer = 0.5 * data.spot_size
        cone = {"cone": [outer * (1 - data.spot_blend), outer]}
        half[:] = 0.5 * math.sqrt(math.pi) * max(data.shadow_soft_size, 1e-3)
        colour = colour / (4 * math.pi) / (4 * half[0] * half[1])
    elif data.type == "SUN":
        half[:] = FAR_AWAY * math.tan(max(data.angle, 1e-3) / 2)
        centre = centre + FAR_AWAY * turn[:, 2]
        colour = colour * FAR_AWAY ** 2 / (4 * half[0] * half[1])
    else:
        colour = colour / (4 * math.pi)
    # It shines along its -z: the side of u x v.
    return {"name": item.name, "centre": centre.tolist(), "u": (half[1] * turn[:, 1]).tolist(),
            "v": (half[0] * turn[:, 0]).tolist(), "radiance": colour.tolist(), "mesh": -1, **cone}


def switched_on(layer):
    """The objects of a layer collection and those within it that are not switched off for rendering."""
    if layer.collection.hide_render:
        return set()
    return (set() if layer.exclude else set(layer.collection.objects)).union(*map(switched_on, layer.children))


def rendered(scene):
    shown = set().union(*(switched_on(layer.layer_collection) for layer in scene.view_layers if layer.use))
    return [item for item in scene.objects if item in shown and not item.hide_render]


def evaluated(scene, depsgraph, kinds):
    return [item.evaluated_get(depsgraph) for item in rendered(scene) if item.type in kinds]


def ambient(scene):
    """The irradiance of a world of one colour; nothing is known of others'."""
    if scene.world is None:
        return [0.0, 0.0, 0.0]
    colour, strength = list(scene.world.color), 1.0
    node = scene.world.node_tree.nodes.get("Background") if scene.world.use_nodes else None
    if node is not None:
        colour, strength = node.inputs["Color"].default_value[:3], node.inputs["Strength"].default_value
    return [math.pi * strength * channel for channel in colour]


def announcement(scene, depsgraph, scene_file):
    return {"format": "polyhull-announcement", "version": 1, "viewport": viewport(scene, depsgraph),
            "scene": str(scene_file), "lights": [light(item) for item in evaluated(scene, depsgraph, {"LIGHT"})],
            "exposure": 2.0 ** scene.view_settings.exposure, "ambient": ambient(scene)}


def settings_of(material):
    """What a material is set to. Node groups and the pixels of pictures are not looked into."""
    if material is None:
        return None
    found = [material.name, tuple(material.diffuse_color), material.use_backface_culling]
    for node in material.node_tree.nodes if material.use_nodes else ():
        found += [node.name, node.image.name if getattr(node, "image", None) else ""]
        for socket in (*node.inputs, *node.outputs):
            value = getattr(socket, "default_value", None)
            found.append(tuple(value) if hasattr(value, "__len__") else value)
    return found


SOLID = {"MESH", "CURVE", "SURFACE", "META", "FONT"}


def instances(scene, depsgraph):
    """What the scene's objects repeat elsewhere (collections, vertices, faces, particles), and where to. Not
    by geometry nodes: the exporter leaves those out."""
    shown = set(rendered(scene))
    return [(item.instance_object, item.matrix_world.copy()) for item in depsgraph.object_instances
            if item.is_instance and item.parent.original in shown and item.parent.original.is_instancer
            and item.instance_object.type in SOLID]


def shape_of(scene, depsgraph):
    """Changes where anything solid moves, bends, gets another material or its material another setting."""
    digest = hashlib.sha256()
    found = [(item, item.matrix_world) for item in evaluated(scene, depsgraph, SOLID)]
    found += instances(scene, depsgraph)
    known = set()
    for item, matrix in found:
        digest.update(repr(item.name_full).encode() + numpy.array(matrix, dtype=numpy.float32).tobytes())
        if item.name_full in known:  # instances share its mesh
            continue
        known.add(item.name_full)
        mesh = item.to_mesh()
        points = numpy.empty(3 * len(mesh.vertices), dtype=numpy.float32)
        mesh.vertices.foreach_get("co", points)
        digest.update(points.tobytes())
        digest.update(repr([settings_of(slot.material) for slot in item.material_slots]).encode())
        item.to_mesh_clear()
    return digest.digest()


def export(scene, path):
    """With modifiers, as it is at this frame. Blender's own exporter needs its add-on, and knows nothing of
    collections that are switched off."""
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    shown = set(rendered(scene))
    hidden = [item for item in scene.objects if item not in shown and not item.hide_render]
    for item in hidden:
        item.hide_render = True
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", use_renderable=True, export_apply=True,
                              export_cameras=True, export_lights=True, export_extras=True,
                              export_animations=False, export_current_frame=True, export_yup=True)
    for item in hidden:
        item.hide_render = False


def prepare(scene, options):
    """Picture value = radiance x exposure, as sRGB, is what composite reckons with."""
    scene.display_settings.display_device = "sRGB"
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.gamma = 1.0
    scene.view_settings.use_curve_mapping = False
    scene.render.use_border = scene.render.film_transparent = False
    scene.render.dither_intensity = 0.0
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.color_depth = "8"
    if options.size:
        scene.render.resolution_x, scene.render.resolution_y = options.size
        scene.render.resolution_percentage = 100
    if options.engine:
        scene.render.engine = options.engine
    if options.samples:
        scene.cycles.samples = options.samples
        scene.cycles.use_adaptive_sampling = False
    if not _cycles.with_openimagedenoise:  # Debian's
        scene.cycles.use_denoising = False


def depth_output(scene, folder):
    """Lets Blender write each frame's depth, whatever else it does with the picture."""
    for left in folder.glob("depth-*.exr"):  # by a run that was stopped
        left.unlink()
    view_layer = next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])
    view_layer.use_pass_z = True
    composited = scene.use_nodes and scene.render.use_compositing
    scene.use_nodes = scene.render.use_compositing = True
    nodes = scene.node_tree.nodes
    layers = nodes.new("CompositorNodeRLayers")
    layers.scene, layers.layer = scene, view_layer.name
    if not composited:  # what was switched off must not change the picture now: it is handed on as it is
        for node in [node for node in nodes if node != layers]:
            nodes.remove(node)
        scene.node_tree.links.new(layers.outputs["Image"], nodes.new("CompositorNodeComposite").inputs["Image"])
    output = nodes.new("CompositorNodeOutputFile")
    output.base_path = str(folder)
    output.file_slots[0].path = "depth-"
    output.format.file_format, output.format.color_depth = "OPEN_EXR", "32"
    scene.node_tree.links.new(layers.outputs["Depth"], output.inputs[0])


def read_depth(scene, folder, near):
    """The depth just written as 65535 near / z, from the upper row down, rows filled up to whole four
    bytes, as rawvideoparse takes them; 0 where nothing is."""
    path, = folder.glob("depth-*.exr")
    width, height = size_of(scene)
    image = bpy.data.images.load(str(path))
    depth = numpy.empty(4 * width * height, dtype=numpy.float32)
    image.pixels.foreach_get(depth)
    bpy.data.images.remove(image)
    path.unlink()
    depth = depth.reshape(height, width, 4)[::-1, :, 0].astype(float)
    rows = numpy.zeros((height, width + width % 2), dtype="<u2")
    rows[:, :width] = numpy.rint(65535 * numpy.clip(near / numpy.maximum(depth, 1e-9), 0, 1))
    return rows.tobytes()


def timecode(number, rate):
    """A count of whole frames a second; at 29.97 it is one without dropping."""
    seconds, frames = divmod(number, math.ceil(rate))
    return f"{seconds // 3600 % 24:02}:{seconds // 60 % 60:02}:{seconds % 60:02}:{frames:02}"


def pipeline(folder, first, last, size, rate, with_depth):
    """What composites with the frames; a mesh is to be added, and a sink."""
    fraction = f"framerate={rate.numerator}/{rate.denominator}"
    depth = (f" filesrc location={folder}/depth.gray16 ! rawvideoparse format=gray16-le width={size[0]} "
             f"height={size[1]} {fraction} ! timecodestamper ! plate.depth") if with_depth else ""
    return (f"multifilesrc location={folder}/frames/%04d.png start-index={first} stop-index={last} "
            f"caps=image/png,{fraction} ! pngdec ! timecodestamper ! "
            f"trackstamp name=plate ! mix.background filesrc location={folder}/announcements.jsonl ! "
            f"plate.scene{depth} composite name=mix")


def whole_pair(sign):
    def read(text):
        first, second = (int(part) for part in text.split(sign))
        return first, second
    return read


def parse():
    parser = argparse.ArgumentParser(prog="render_scene.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--frames", type=whole_pair("-"), help="first and last, as in 1-50; else the scene's")
    parser.add_argument("--size", type=whole_pair("x"), help="as in 1280x720; else the scene's")
    parser.add_argument("--engine", choices=["CYCLES", "BLENDER_EEVEE", "BLENDER_WORKBENCH"],
                        help="else the scene's; EEVEE and Workbench need a graphics driver")
    parser.add_argument("--samples", type=int, help="of Cycles; else the scene's")
    parser.add_argument("--depth", type=float, metavar="METRES",
                        help="writes the depth, too; METRES is the nearest that is told apart, as in 0.5")
    parser.add_argument("--to", help="also sends each line by UDP when its frame is there: HOST:PORT")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else ["--help"])


def main():
    options = parse()
    scene = bpy.context.scene
    prepare(scene, options)
    first, last = options.frames or (scene.frame_start, scene.frame_end)
    rate = frame_rate(scene.render.fps, scene.render.fps_base)
    folder = options.folder.absolute()
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM) if options.to else None
    shape = scene_file = None
    if options.depth:
        depth_output(scene, folder)
        (folder / "depth.gray16").write_bytes(b"")
    with open(folder / "announcements.jsonl", "w") as lines:
        for number in range(first, last + 1):
            scene.frame_set(number)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            if shape != (shape := shape_of(scene, depsgraph)):
                # Another name each time: composite reads a file once.
                scene_file = folder / f"scene-{number:04}.glb"
                export(scene, scene_file)
                depsgraph = bpy.context.evaluated_depsgraph_get()
            said = announcement(scene, depsgraph, scene_file)
            said["timecode"] = timecode(number - first, rate)
            said["timecode_rate"] = [rate.numerator, rate.denominator]
            said["stream_time_ns"] = math.floor((number - first) * 1_000_000_000 / rate)
            if options.depth:
                said["depth_near"] = options.depth
            scene.render.filepath = str(folder / "frames" / f"{number:04}.png")
            bpy.ops.render.render(write_still=True)
            if options.depth:
                with open(folder / "depth.gray16", "ab") as depth:
                    depth.write(read_depth(scene, folder, options.depth))
            line = json.dumps(said) + "\n"
            lines.write(line)
            lines.flush()
            if sender:
                host, port = options.to.rsplit(":", 1)
                sender.sendto(line.encode(), (host, int(port)))
    print("To composite with it:\n  gst-launch-1.0",
          pipeline(folder, first, last, size_of(scene), rate, options.depth))


if __name__ == "__main__":
    main()
