#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Names the tests nearest to what the working tree changes (or, where it changes nothing, to the last
commit), one a line, nearest first, as many as run within a time.

usage: nearest.py BUILD-FOLDER [SECONDS] [FILE...]

A test is near by its name and by what it includes and links, as the build folder knows it: (0) its own source
changed, or it is called as the changed file or element; (1) it, or another source of its program, includes the
changed header or the header of the changed source; (2) it includes a header of the same folder; (3) it links an
object made from a changed file; (4) it runs the plugin made from one. Within a distance the quickest come first, by
the times of the last runs. Of 0 all are taken, of the others those that the time (100 s, two at once) leaves room for."""
import json
import pathlib
import re
import subprocess
import sys

import summary

ROOT = pathlib.Path(__file__).resolve().parent.parent


def lines_of(*command, folder=ROOT):
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.splitlines()


def changed_files():
    now = lines_of("git", "diff", "--name-only", "HEAD") + lines_of("git", "ls-files", "--others", "--exclude-standard")
    return now or lines_of("git", "diff", "--name-only", "HEAD~1", "HEAD")


def inputs_of_targets(build):
    """Each built file's inputs, by build.ninja; without those that only have to be there before."""
    inputs = {}
    text = (build / "build.ninja").read_text().replace("$\n", "").replace("$ ", "\0")
    for outputs, rest in re.findall(r"^build (.*?): \S+ ?(.*)$", text, re.M):
        parts = [part.replace("\0", " ") for part in rest.split(" || ")[0].replace(" | ", " ").split()]
        for output in outputs.replace(" | ", " ").split():
            inputs[output.replace("\0", " ")] = parts
    return inputs


def sources_of_objects(build):
    """Each object's source and headers, from the root; of compiled objects only."""
    sources, current = {}, None
    for line in lines_of("ninja", "-t", "deps", folder=build):
        if line and not line.startswith(" "):
            current = sources.setdefault(line.split(":")[0], set())
        elif line.startswith("    "):
            path = (build / line.strip()).resolve()
            if path.is_relative_to(ROOT) and not path.is_relative_to(build):
                current.add(str(path.relative_to(ROOT)))
    return sources


def last_times(build):
    """Seconds of each test in its last run."""
    logs = sorted(build.glob("meson-logs/*.json"), key=lambda path: path.stat().st_mtime)
    return {summary.name_of(result): result["duration"] for log in logs for result in summary.results_of(log)
            if result["result"] == "OK"}


class Build:
    def __init__(self, folder):
        self.folder = folder
        self.inputs = inputs_of_targets(folder)
        self.sources = sources_of_objects(folder)
        self.reached = {}

    def objects(self, target):
        """All objects that are linked into a built file, also through libraries."""
        if target not in self.reached:
            self.reached[target] = set()  # ends circles
            found = {target} if target in self.sources else set()
            for item in self.inputs.get(target, []):
                found |= self.objects(item)
            self.reached[target] = found
        return self.reached[target]

    def includes(self, objects):
        return set().union(*(self.sources.get(item, set()) for item in objects))


def distance(build, test, changed):
    """0 to 4 as above, or None where the change cannot reach the test."""
    program = str(pathlib.Path(test["cmd"][0]).resolve())
    commands = {str(pathlib.Path(word).resolve()) for word in test["cmd"]}
    if commands & {str(ROOT / path) for path in changed}:
        return 0
    target = program.removeprefix(str(build.folder) + "/")
    own = build.includes(item for item in build.inputs.get(target, []) if item in build.sources)
    called = {path.split("/")[1] if path.startswith("plugins/") else pathlib.PurePath(path).stem for path in changed}
    name = test["name"].removeprefix("element-")
    if any(name + "_test" == word or name == word or name.startswith(word + "_") for word in called):
        return 0
    headers = {re.sub(r"\.(cpp|inc)$", ".h", path) for path in changed} | changed
    if own & headers:
        return 1
    folders = {str(pathlib.PurePath(path).parent) for path in changed}
    if {str(pathlib.PurePath(path).parent) for path in own} & folders:
        return 2
    if build.includes(build.objects(target)) & changed:
        return 3
    if any(build.includes(build.objects(item)) & changed for item in test["depends_files"]):
        return 4
    return None


def main():
    build_folder = pathlib.Path(sys.argv[1]).resolve()
    budget = float(sys.argv[2]) if len(sys.argv) > 2 else 100.0
    changed = set(sys.argv[3:] or changed_files())
    build, seconds = Build(build_folder), last_times(build_folder)
    targets = {target["id"]: [str(pathlib.Path(path).relative_to(build_folder)) for path in target["filename"]]
               for target in json.loads("\n".join(lines_of("meson", "introspect", "--targets", str(build_folder))))}
    near = []
    for test in json.loads("\n".join(lines_of("meson", "introspect", "--tests", str(build_folder)))):
        test["depends_files"] = [path for item in test["depends"] for path in targets.get(item, [])]
        far = distance(build, test, changed)
        if far is not None:
            near.append((far, seconds.get(test["name"], 5.0), test["name"]))
    room = 2 * budget
    for far, time, name in sorted(near):
        if far == 0 or time <= room:
            room -= time
            print(name)


if __name__ == "__main__":
    main()
