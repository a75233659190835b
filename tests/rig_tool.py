#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""polyhull-rig as a program: export, check, and check --pictures on masks of a box."""
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
import zlib

TOOL = sys.argv[1]


def run(*arguments, fails=False):
    result = subprocess.run([TOOL, *arguments], capture_output=True, text=True)
    assert (result.returncode != 0) == fails, (arguments, result.stdout, result.stderr)
    return result.stderr if fails else result.stdout


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def project(camera, point):
    x, y, z = (dot(row, point) + t for row, t in zip(camera["R"], camera["t"]))
    k = camera["K"]
    return k[0][0] * x / z + k[0][2], k[1][1] * y / z + k[1][2]


def write_picture(path, width, height, rows, kind):
    """8-bit PNG; kind: 0 grey, 2 RGB."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(b"".join(b"\0" + row for row in rows), 1)) + chunk(b"IEND", b""))


def write_grey(path, width, height, rows):
    write_picture(path, width, height, rows, 0)


def write_mask(path, camera, low, high):
    """The silhouette of an axis-aligned box: the convex outline of its corners, row by row."""
    corners = [project(camera, [(low, high)[i >> axis & 1][axis] for axis in range(3)]) for i in range(8)]
    width, rows = camera["width"], []
    for y in range(camera["height"]):
        crossed = [a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1])
                   for a in corners for b in corners if a[1] <= y < b[1]]
        left, right = (max(0, int(min(crossed)) + 1), min(width, int(max(crossed)) + 1)) if crossed else (0, 0)
        rows.append(bytes(left) + b"\xff" * max(0, right - left) + bytes(width - max(left, right)))
    write_grey(path, width, camera["height"], rows)


def number_after(text, words):
    return float(text.split(words, 1)[1].split()[0])


def check_plan(folder):
    small = ["--picture", "128x96", "--fov", "72", "--distance", "3", "--heights", "1.4"]
    planned, drawing = os.path.join(folder, "planned.json"), os.path.join(folder, "plan.svg")
    text = run("plan", "--cameras", "3", *small, "--room", "5x7", "--drawing", drawing, "-o", planned)
    assert "off facing" in text and "by more" in text, text
    with open(planned) as file:
        rig = json.load(file)
    assert [camera["name"] for camera in rig["cameras"]] == ["cam0", "cam1", "cam2"], rig
    assert rig["bounds"] == {"min": [-1.2, 0, -1.2], "max": [1.2, 2.3, 1.2]}, rig
    assert rig["cameras"][0]["width"] == 128 and rig["cameras"][0]["height"] == 96, rig
    svg = xml.etree.ElementTree.parse(drawing).getroot()
    circles = [node for node in svg.iter() if node.tag.endswith("circle")]
    assert svg.tag.endswith("svg") and len(circles) == 3, drawing

    # Within walls that are nearer than the distance.
    rows = [line.split() for line in text.splitlines() if line.startswith("cam")]
    assert len(rows) == 3 and all(abs(float(row[4])) <= 2.2 for row in rows), text
    assert text.count("counter-clockwise from above") == 1, text
    for row in rows:
        assert abs((float(row[1]) + 180) % 360 - float(row[10])) < .2 and float(row[11]) < 0, row
    assert len([node for node in svg.iter() if node.tag.endswith("rect")]) == 3, drawing

    # The same forecast for the file, and what one more would bring.
    checked = run("check", planned)
    words = "refined surface"
    assert number_after(checked, words) == number_after(text, words), (checked, text)
    assert "one camera more would bring most at azimuth" in checked, checked
    assert number_after(checked, "body, refined ") < number_after(text, words), checked
    assert "one camera more" not in run("check", "--no-forecast", planned)

    for arguments, words in ((["--stage", "2x2"], "WIDTHxDEPTHxHEIGHT"), (["--stage", "1x.3x2.3"], "1.2 x 1.2 x 2 m"),
                             (["--picture", "big"], "WIDTHxHEIGHT"), (["--room", "5"], "WIDTHxDEPTH"),
                             (["--room", "2.5x9"], "more than 3 x 3 m"), (["--cameras", "1"], "2 to 64"),
                             (["--distance", "1.8", "--fov", "40"], "field of view of"),
                             (["--drawing", "/nowhere/plan.svg", *small], "/nowhere/plan.svg")):
        note = run("plan", *arguments, fails=True)
        assert words in note, (arguments, note)

    # A rig without bounds, and one too small for a person, have no forecast but pass.
    del rig["bounds"]
    with open(planned, "w") as file:
        json.dump(rig, file)
    assert "no forecast: The rig has no bounds" in run("check", planned)


def check_refine(folder, cameras):
    """A rig file in which cam1 stands 3 cm beside where it does, and boxes here and there."""
    folders = {}
    for camera in cameras:
        name = camera["name"]
        folders[name] = os.path.join(folder, "walk-" + name)
        os.mkdir(folders[name])
        for i in range(12):
            x, z, y = 0.5 * math.cos(2.4 * i), 0.5 * math.sin(2.4 * i), 0.1 * (i % 3)
            write_mask(os.path.join(folders[name], f"{name}_{i:03}.png"), camera, [x - 0.2, y, z - 0.3],
                       [x + 0.2, y + 1.3, z + 0.1])
    off = [dict(camera, t=list(camera["t"])) for camera in cameras]
    off[1]["t"][1] += 0.03
    rig, refined = os.path.join(folder, "off.json"), os.path.join(folder, "refined.json")
    with open(rig, "w") as file:
        json.dump({"format": "polyhull-rig", "version": 1, "cameras": off}, file)
    pictures = [f"{name}={path}" for name, path in folders.items()]
    table = run("refine", rig, "--pictures", *pictures, "--only", "cam1", "-o", refined)
    assert "in 12 instants" in table and number_after(table, "error") < 0.5, table
    with open(refined) as file:
        found = json.load(file)["cameras"]
    assert all(abs(a - b) < 0.005 for a, b in zip(found[1]["t"], cameras[1]["t"])), (found[1], cameras[1])
    for i in (0, 2, 3):
        assert all(abs(a - b) < 1e-9 for a, b in zip(found[i]["t"], cameras[i]["t"])), found[i]
    for arguments, words in ((["--only", "cam7"], "'cam7', which the rig does not have"),
                             (["--pictures", os.path.join(folder, "walk-cam0")], "No two folders")):
        given = [] if "--pictures" in arguments else ["--pictures", *pictures]
        note = run("refine", rig, *given, *arguments, "-o", refined, fails=True)
        assert words in note, (arguments, note)


def write_board(path, camera, columns, rows, square):
    """A chessboard of so many inner corners on the floor, its middle at the origin, four samples a pixel."""
    width, depth = (columns + 1) * square, (rows + 1) * square
    margin = [project(camera, [x * (width / 2 + square), 0, z * (depth / 2 + square)])
              for x in (-1, 1) for z in (-1, 1)]
    left, right = (int(f(p[0] for p in margin)) for f in (min, max))
    top, bottom = (int(f(p[1] for p in margin)) for f in (min, max))
    k, r, t = camera["K"], camera["R"], camera["t"]
    centre = [-sum(r[i][j] * t[i] for i in range(3)) for j in range(3)]

    def dark(u, v):
        ray = [sum(r[i][j] * c for i, c in enumerate(((u - k[0][2]) / k[0][0], (v - k[1][2]) / k[1][1], 1)))
               for j in range(3)]
        way = -centre[1] / ray[1]
        x, z = (centre[i] + way * ray[i] for i in (0, 2))
        return abs(x) < width / 2 and abs(z) < depth / 2 and \
            (math.floor((x + width / 2) / square) + math.floor((z + depth / 2) / square)) % 2 == 0
    steps = (-.25, .25)
    lines = [bytearray(b"\xdc" * camera["width"]) for _ in range(camera["height"])]
    for y in range(max(0, top), min(camera["height"], bottom)):
        for x in range(max(0, left), min(camera["width"], right)):
            lines[y][x] -= 45 * sum(dark(x + du, y + dv) for du in steps for dv in steps)
    write_grey(path, camera["width"], camera["height"], [bytes(line) for line in lines])


def check_level(folder, cameras, masks):
    """The floor .25 m above the world's origin, by each way to say so."""
    low, levelled = os.path.join(folder, "low.json"), os.path.join(folder, "level.json")
    moved = [dict(c, t=[t - .25 * row[1] for t, row in zip(c["t"], c["R"])]) for c in cameras]
    with open(low, "w") as file:
        json.dump({"format": "polyhull-rig", "version": 1, "cameras": moved}, file)
    assert "polyhull-rig level" in run("check", "--no-forecast", low)
    marks = os.path.join(folder, "floor.txt")
    with open(marks, "w") as file:
        for name, point in (("a", (0, 0, 0)), ("b", (.5, 0, 0)), ("c", (0, 0, .5))):
            for camera in cameras[:2]:
                file.write("{} {} {} {}\n".format(name, camera["name"], *project(camera, point)))
    pictures = ["--pictures", *(f"{name}={path}" for name, path in masks.items())]
    boards = {camera["name"]: os.path.join(folder, "board_" + camera["name"] + ".png") for camera in cameras[:2]}
    for camera in cameras[:2]:
        write_board(boards[camera["name"]], camera, 6, 3, .12)
    seen = [f"{name}={path}" for name, path in boards.items()]

    def board(*seen, size="6x3", square="120"):
        return ["--board", size, "--square", square, "--pictures", *seen]
    for way, error in ((board(*seen), .002), (board(seen[0]), .01), (["--floor-points", marks], 1e-6),
                       (["--floor", ".25", "--origin", "0", "0", "0"], 1e-6),
                       (["--points", "0", ".25", "0", "-1", ".25", "0", "0", ".25", "2"], 1e-6),
                       (pictures, .012)):
        table = run("level", low, *way, "--stage", "2x3x2.2", "-o", levelled)
        assert "bounds 2 x 3 x 2.2 m from the floor up" in table and "note:" not in table, table
        assert abs(number_after(table, "cam0") - 1.4) < error + 1e-3, table
        with open(levelled) as file:
            found = json.load(file)
        assert found["up"] == [0, 1, 0] and found["bounds"]["min"][1] == 0, found
        heights = [-dot([row[1] for row in c["R"]], c["t"]) for c in found["cameras"]]
        truth = [-dot([row[1] for row in c["R"]], c["t"]) for c in cameras]
        assert all(abs(a - b) < error for a, b in zip(heights, truth)), (way, heights, truth)
    for arguments, words in ((["--points", "1", "2"], "x y z of each point"), ([], "in one way"),
                             (["--floor", "0", "--stage", "big"], "--stage is 'big'"),
                             (["--floor", "0", "--unit", "ell"], "'ell'"), (["--floor", "nan"], "in one way"),
                             (board()[:-1], "--board needs"),
                             *((["--pictures", *seen, option, value], option + " requires --board") for option, value in
                               (("--square", "120"), ("--charuco", "4X4_100"), ("--marker", "90"), ("--thickness", "5"))),
                             ([*board(*seen), "--floor", "0"], "in one way"),
                             (board(*seen, size="9x6"), "none of the 2 pictures"),
                             (board(*seen, square="250"), "beside where the other cameras have it")):
        note = run("level", low, *arguments, "-o", levelled, fails=True)
        assert words in note, (arguments, note)


CHART = """735244 c29682 627a9d 576c43 8580b1 67bdaa d67e2c 505ba6 c15a63 5e3c6c 9dbc40 e0a32e
           383d96 469449 af363c e7c71f bb5695 0885a1 f3f3f2 c8c8c8 a0a0a0 7a7a79 555555 343434"""


def write_chart(path, camera, gain):
    """The chart from (100, 100) on, patches 40 px wide, as a camera of this gain sees it."""
    def seen(code):
        code /= 255
        light = gain * (code / 12.92 if code <= .04045 else ((code + .055) / 1.055) ** 2.4)
        return min(255, round(255 * (12.92 * light if light <= .0031308 else 1.055 * light ** (1 / 2.4) - .055)))
    patches = [bytes(seen(code) for code in bytes.fromhex(patch)) for patch in CHART.split()]
    width, height = camera["width"], camera["height"]
    grey = bytes([90]) * 3
    rows = [grey * width] * 100
    for row in range(4):
        line = b"".join(patch * 40 for patch in patches[6 * row:6 * row + 6])
        rows += [grey * 100 + line + grey * (width - 340)] * 40
    write_picture(path, width, height, rows + [grey * width] * (height - 260), 2)


def check_colours(folder, rig, cameras):
    corners, pictures = [], []
    for camera, gain in zip(cameras, (1.0, 0.8)):
        path = os.path.join(folder, camera["name"] + "_chart.png")
        write_chart(path, camera, gain)
        pictures.append(camera["name"] + "=" + path)
        corners.append(camera["name"] + "=100,100,339,100,339,259,100,259")
    arguments = ["colours", rig, "--pictures", *pictures, "--corners", *corners, "--reference"]
    for reference in "cam0", "chart":
        lines = run(*arguments, reference).splitlines()
        assert "24 patches" in lines[0], lines
        assert max(map(float, lines[1].split()[1:])) < 0.01, lines
        name, mean, worst, mean_after, worst_after = lines[5].split()
        assert name == "cam1" and 3 < float(mean) < float(worst) and float(worst_after) < 1, lines
        assert abs(float(lines[6].split()[0]) - 1.25) < 0.02, lines
    assert "cam9" in run(*arguments, "cam9", fails=True)
    # The matrices are kept in the rig file, and its copies.
    matched = os.path.join(folder, "matched.json")
    run(*arguments, "cam0", "-o", matched)
    for of in matched, os.path.join(folder, "matched_copy.json"):
        with open(of) as file:
            kept = json.load(file)["cameras"]
        assert abs(kept[1]["colour"][1][1] - 1.25) < 0.02 and len(kept) == len(cameras), kept[1]
        assert abs(kept[0].get("colour", [[1]])[0][0] - 1) < 1e-4 and "colour" not in kept[-1], kept
        run("export", matched, "-o", os.path.join(folder, "matched_copy.json"))
    # White as a grey card.
    grey = [camera["name"] + "=104,224,132,252" for camera in cameras[:2]]
    card = ["colours", rig, "--pictures", *pictures, "--grey", *grey, "--reference", "cam0"]
    lines = run(*card, "-o", matched).splitlines()
    assert "a grey card" in lines[0] and float(lines[5].split()[4]) < 0.01, lines
    with open(matched) as file:
        assert abs(json.load(file)["cameras"][1]["colour"][2][2] - 1.25) < 0.02
    assert "Give either --corners" in run(*card, "--corners", *corners, fails=True)
    assert "goes without" in run(*card, "--overlaps", fails=True)
    note = run("colours", rig, "--overlaps", "--pictures", *pictures, fails=True)
    assert "_chart.png" in note, note
    assert "within the grey card" in run(*card[:-2], "cam0=1,2,3", fails=True)
    note = run("colours", rig, "--pictures", *pictures, "--corners", corners[0], fails=True)
    assert "'cam1' has no --corners" in note, note
    note = run("colours", rig, "--pictures", pictures[0], "--corners", *corners, fails=True)
    assert "'cam1' has --corners but no picture" in note, note
    note = run("colours", rig, "--pictures", pictures[0], "--corners", "cam0=1,2,3", fails=True)
    assert "cam0=1,2,3" in note and "dark skin" in note, note
    write_chart(pictures[1].split("=")[1], cameras[1], 1.3)
    result = subprocess.run([TOOL, *arguments, "cam0"], capture_output=True, text=True)
    assert "white (cam1)" in result.stderr and result.returncode == 0, result
    write_chart(pictures[1].split("=")[1], cameras[1], 100)
    assert "are well exposed" in run(*arguments, "cam0", fails=True)


def check_import_notes(folder):
    """Two instants of each camera, saved on Windows: four cameras, and a note."""
    model = os.path.join(folder, "colmap")
    run("export", "--format", "colmap", "-o", model)
    images = os.path.join(model, "images.txt")
    with open(images) as file:
        lines = file.read()
    with open(images, "w", encoding="utf-8-sig", newline="\r\n") as file:
        file.write(lines.replace(".png", " (1).png") + lines.replace(".png", " (2).png"))
    result = subprocess.run([TOOL, "import", "colmap", model], capture_output=True, text=True)
    assert result.returncode == 0, result
    assert [camera["name"] for camera in json.loads(result.stdout)["cameras"]] == \
        ["cam0 (1)", "cam1 (1)", "cam2 (1)", "cam3 (1)"], result
    assert "note: several images are of one camera at one place" in result.stderr, result
    assert "'cam0 (1).png', not 'cam0 (2).png'" in result.stderr, result


def main():
    with tempfile.TemporaryDirectory() as folder:
        text = run("export")
        rig = json.loads(text)
        assert [camera["name"] for camera in rig["cameras"]] == ["cam0", "cam1", "cam2", "cam3"], text
        assert rig["format"] == "polyhull-rig" and rig["unit"] == "m" and "bounds" in rig, text

        # The copy is the same rig, and so is the copy of a copy; P becomes K, R and t.
        copy = os.path.join(folder, "copy.json")
        assert run("export", "-o", copy) == ""
        assert run("export", copy) == text
        assert "nothing found wrong" in run("check", "--no-forecast", copy)
        for camera in rig["cameras"]:
            columns = [*zip(*camera["R"]), camera["t"]]
            camera["P"] = [[dot(row, column) for column in columns] for row in camera["K"]]
            for field in ("K", "R", "t"):
                del camera[field]
        with open(copy, "w") as file:
            json.dump(rig, file)
        again = json.loads(run("export", copy))
        for camera, truth in zip(again["cameras"], json.loads(text)["cameras"]):
            assert all(abs(a - b) < 1e-9 for a, b in zip(camera["t"], truth["t"])), camera
        assert "/nowhere/rig.json" in run("export", "/nowhere/rig.json", fails=True)
        assert "/nowhere/x.json" in run("export", "-o", "/nowhere/x.json", fails=True)

        # Another unit than the file says.
        rig = json.loads(text)
        rig["unit"] = "mm"
        with open(copy, "w") as file:
            json.dump(rig, file)
        note = run("check", copy)
        assert "note: the cameras stand 0.00" in note and "too near" in note and "--unit m," in note, note

        assert "no forecast: The stage is 0.0024" in note, note
        check_plan(folder)
        check_import_notes(folder)

        # A box off the middle of the stage.
        cameras = json.loads(text)["cameras"]
        masks = {}
        for camera in cameras:
            masks[camera["name"]] = os.path.join(folder, camera["name"] + ".png")
            write_mask(masks[camera["name"]], camera, [0.1, 0.0, -0.4], [0.5, 1.6, 0.2])
        good = run("check", "--pictures", *masks.values())
        assert "nothing found wrong" in good and "hull of the other cameras" in good, good
        swapped = dict(masks, cam1=masks["cam3"], cam3=masks["cam1"])
        note = run("check", "--pictures", *(f"{name}={path}" for name, path in swapped.items()))
        assert "cam1 and cam3 look swapped" in note, note
        # Three cameras of four, in an order of their own.
        some = run("check", "--pictures", masks["cam2"], masks["cam0"], masks["cam3"])
        assert "nothing found wrong" in some and "cam1  " not in some.split("pictures:")[1], some

        check_level(folder, cameras, masks)
        check_refine(folder, cameras)
        check_colours(folder, copy, cameras)

        note = run("check", "--pictures", "cam9=" + masks["cam0"], fails=True)
        assert "cam9" in note and "cam0, cam1, cam2, cam3" in note, note
        assert "two cameras" in run("check", "--pictures", masks["cam0"], fails=True)
        small = os.path.join(folder, "small.png")
        write_grey(small, 8, 8, [bytes(8)] * 8)
        note = run("check", "--pictures", "cam0=" + small, masks["cam1"], fails=True)
        assert "small.png" in note and "8x8" in note and "1024x768" in note, note
        empty = os.path.join(folder, "empty.png")
        write_grey(empty, 1024, 768, [bytes(1024)] * 768)
        note = run("check", "--pictures", "cam0=" + empty, masks["cam1"], fails=True)
        assert "empty.png" in note and "no subject" in note, note
    print("ok")


main()
