#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Holds docs/architecture.md against the code: each folder includes what its row says, no more and no
less, none in a circle, and every file and function that the page names is there.

usage: architecture.py"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SOURCES = {".cpp", ".h", ".inc"}
INCLUDE = re.compile(r'^#include "([^"]+)"', re.M)


def room_of(path):
    """The folder of an include in the page's words: of lib its own name, of others the whole."""
    return str(pathlib.PurePosixPath(path).parent)


def included(folder):
    """What the sources of lib/… or studio/… include from other rooms."""
    found = {}
    for source in sorted(folder.iterdir()):
        if source.suffix not in SOURCES:
            continue
        for include in INCLUDE.findall(source.read_text()):
            if include.endswith("_generated.h"):
                continue
            found.setdefault(room_of(include), source.relative_to(ROOT))
    return found


def check_rows(page):
    problems = []
    rows = re.findall(r"^\| `((?:lib|studio)/[\w/]+)` \|[^|]*\|([^|]*)\|$", page, re.M)
    allowed = {name: {item.strip() for item in items.split(",") if item.strip()} for name, items in rows}
    folders = {str(path.relative_to(ROOT)) for top in ("lib", "studio") for path in (ROOT / top).rglob("*")
               if path.is_dir() and path.name != "precompiled" and any(child.suffix in SOURCES for child in path.iterdir())}
    for name in sorted(folders ^ allowed.keys()):
        problems.append(f"{name} is {'not on the page' if name in folders else 'on the page, but there is no such folder'}")
    for name in sorted(folders & allowed.keys()):
        own = name.removeprefix("lib/")
        uses = included(ROOT / name)
        for room in sorted(uses.keys() - allowed[name] - {own}):
            problems.append(f"{uses[room]} includes {room}, which the row of {name} does not allow")
        for room in sorted(allowed[name] - uses.keys()):
            problems.append(f"{name} no longer includes {room}: take it out of its row")
    return problems


def check_circles():
    """No folder includes, be it by way of others, one that includes it."""
    uses = {}
    for top in ("lib", "studio"):
        for folder in [ROOT / top, *(path for path in (ROOT / top).rglob("*") if path.is_dir())]:
            name = str(folder.relative_to(ROOT)).removeprefix("lib/")
            uses[name] = set(included(folder)) - {name}
    while ends := {name for name, rooms in uses.items()
                   if not rooms & uses.keys() or not any(name in others for others in uses.values())}:
        uses = {name: rooms for name, rooms in uses.items() if name not in ends}
    return [f"{name} is in a circle: it includes {', '.join(sorted(rooms & uses.keys()))}"
            for name, rooms in sorted(uses.items())]


def unnamed(source):
    """Names of functions, types and values in a source's unnamed namespaces."""
    names, depth = set(), False
    for line in source.read_text().splitlines():
        if line.startswith("namespace {"):
            depth = True
        elif line.startswith("}  // namespace"):
            depth = False
        elif depth and (found := re.match(r"(?:struct|class|enum class) (\w+)|[a-zA-Z][^=;()]*?[ &*>](\w+)(?:\(|\[| = |\{|;)", line)):
            if not line.startswith(("return", "template", "using ", "}")):
                names.add(found[1] or found[2])
    return names


def check_units():
    """The sources of a folder are compiled together: a name that two of them use might find the other's overload."""
    problems = []
    for top in ("lib", "studio", "plugins", "tools/rig"):
        for folder in sorted(path for path in [ROOT / top, *(ROOT / top).rglob("*")] if path.is_dir()):
            seen = {}
            for source in sorted(folder.glob("*.cpp")):
                if source.name == "figure_skin_writer.cpp" or re.search(r"_(plain|baseline|avx2|avx512)\.cpp$", source.name):
                    continue
                for name in sorted(unnamed(source)):
                    if name in seen:
                        problems.append(f"{source.relative_to(ROOT)} and {seen[name]} both have their own {name}")
                    seen.setdefault(name, source.name)
    return problems


def check_plugins():
    """Elements know plugins/common and the library, but not each other; rigtestsrc alone the studio."""
    problems = []
    for source in sorted((ROOT / "plugins").rglob("*")):
        if source.suffix not in SOURCES or source.name == "plugin.cpp":
            continue
        own = source.relative_to(ROOT / "plugins").parts[0]
        for include in INCLUDE.findall(source.read_text()):
            if include.startswith("plugins/") and include.split("/")[1] not in ("common", own):
                problems.append(f"{source.relative_to(ROOT)} includes {include}, another element's")
            if include.startswith("studio/") and own != "rigtestsrc":
                problems.append(f"{source.relative_to(ROOT)} includes {include}: the studio is for tests")
    for top in ("lib", "studio"):
        for source in sorted((ROOT / top).rglob("*")):
            if source.suffix in SOURCES and re.search(r"#include [<\"](gst/|glib|plugins/)", source.read_text()):
                problems.append(f"{source.relative_to(ROOT)} includes GStreamer or an element")
            if top == "lib" and source.suffix in SOURCES and '#include "studio/' in source.read_text():
                problems.append(f"{source.relative_to(ROOT)} includes the studio")
    return problems


def check_names(page):
    problems = []
    for name, function in re.findall(r"`((?:lib|studio|plugins|shaders|tests|tools)/[\w/.*-]+?)(?::(\w+))?`", page):
        path = ROOT / name
        if "*" in name or "NAME" in name or "ELEMENT" in name:
            continue
        if not path.exists():
            problems.append(f"the page names {name}, which is not there")
        elif function and not re.search(rf"\b{function}\(", path.read_text()):
            problems.append(f"the page names {name}:{function}, but there is no such function")
    return problems


def main():
    page = (ROOT / "docs" / "architecture.md").read_text()
    problems = check_rows(page) + check_circles() + check_plugins() + check_units() + check_names(page)
    for folder in {path.parent for top in ("lib", "studio", "plugins", "tools") for path in (ROOT / top).rglob("*.cpp")}:
        count = sum(child.suffix in SOURCES for child in folder.iterdir())
        if count > 26:
            problems.append(f"{folder.relative_to(ROOT)} holds {count} sources: make rooms of it")
    print("\n".join(problems) or "docs/architecture.md holds")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
