#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whether each file includes what it needs: a header compiles with nothing before it, a source without the build's
precompiled header and without the other sources of its unit. NAME.cpp includes NAME.h first, so that compiling the
source shows both. Compiled here, for their syntax and with the flags of the build folder, are what the working tree or
the last commit changed and a quarter of the headers that have no such source, with each commit another one; with --all, or
POLYHULL_LONG=1, all of these headers and every source. What was good is not compiled again before its text, or that
of a file that it includes, changes.

usage: includes.py BUILD-FOLDER [--all] [--jobs N]"""
import argparse
import collections
import concurrent.futures
import functools
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDERS = ("lib", "studio", "plugins", "tools")
INCLUDE = re.compile(rb'^[ \t]*#[ \t]*include[ \t]*(?:<[^>]+>|"([^"]+)")', re.M)
NO_FLAG = re.compile(r"-(M|W|O|g|o$|c$|include$|fpch|fdiagnostics|fsanitize)|.*\.(o|d|cpp|pch|gch)$|ccache$")


@functools.cache
def text_of(path):
    return path.read_bytes()


def git(*arguments):
    result = subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, text=True)
    return result.stdout.split() if result.returncode == 0 else []


def commands_of(build):
    """Of each source the compiler with the flags that say how a file is read."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        words = shlex.split(entry["command"])
        flags = [word for before, word in zip([""] + words, words)
                 if not NO_FLAG.match(word) and before not in ("-o", "-MF", "-MQ", "-include")]
        source = pathlib.Path(os.path.normpath(build / entry["file"]))
        # A unit includes the sources of a folder.
        parts = [name.decode() for name in INCLUDE.findall(text_of(source))] if source.name.startswith("unit_") else []
        for path in [ROOT / "lib" / name if (ROOT / "lib" / name).exists() else ROOT / name for name in parts] or [source]:
            found[path] = tuple(flags)
    return found


def headers_with_flags(commands, headers):
    """Of each header those of most sources of its folder, or of the next one above."""
    by_folder = collections.defaultdict(collections.Counter)
    for source, flags in commands.items():
        for folder in source.parents:
            by_folder[folder][flags] += 1
    return {header: by_folder[next(folder for folder in header.parents if by_folder[folder])].most_common(1)[0][0]
            for header in headers}


def included_by(path, flags, build):
    """The project's files that reading \"path\" reads, itself too."""
    folders = [build / flag[2:] for flag in flags if flag.startswith("-I")]
    seen, left = set(), [path]
    while left:
        item = left.pop()
        if item in seen:
            continue
        seen.add(item)
        for name in filter(None, INCLUDE.findall(text_of(item))):
            places = (pathlib.Path(os.path.normpath(folder / name.decode())) for folder in [item.parent, *folders])
            left += [place for place in places if place.is_file()][:1]
    return sorted(seen)


def stamp_of(path, flags, build):
    digest = hashlib.sha256("\0".join((str(path), *flags)).encode())
    for item in included_by(path, flags, build):
        digest.update(str(item).encode() + b"\0" + text_of(item))
    return digest.hexdigest()


def own_header_first(header):
    """Whether NAME.cpp has NAME.h for its first include; none: there is no such source."""
    source = header.with_suffix(".cpp")
    if not source.exists():
        return None
    first = INCLUDE.search(text_of(source))
    return first is not None and (first[1] or b"").decode().split("/")[-1] == header.name


def compiles(path, flags, build):
    command = [*flags, "-w", "-fsyntax-only", "-x", "c++", path]
    result = subprocess.run(command, cwd=build, capture_output=True, text=True)
    return "" if result.returncode == 0 else "\n".join(result.stderr.splitlines()[:12]) or "the compiler failed"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    build = options.build.resolve()
    commands = commands_of(build)
    headers = [ROOT / name for name in git("ls-files", "-co", "--exclude-standard", *FOLDERS)
               if name.endswith(".h") and (ROOT / name).exists()]
    if not headers:
        print("SKIPPED: this is no git checkout, whose files are checked")
        sys.exit(77)
    problems = [f"{header.relative_to(ROOT).with_suffix('.cpp')} does not include {header.name} first"
                for header in headers if own_header_first(header) is False]
    changed = {ROOT / name for name in git("diff", "--name-only", "HEAD^") + git("ls-files", "-o", "--exclude-standard")}
    everything = options.all or "POLYHULL_LONG" in os.environ
    commit = "".join(git("rev-parse", "HEAD"))
    files = headers_with_flags(commands, [h for h in headers if h in changed or not own_header_first(h) and (
        everything or zlib.crc32(f"{commit} {h.relative_to(ROOT)}".encode()) % 4 == 0)])
    files |= {source: flags for source, flags in commands.items()
              if ROOT in source.parents and build not in source.parents and source.suffix == ".cpp"
              and (everything or source in changed)}
    stamps = {path: stamp_of(path, flags, build) for path, flags in files.items()}
    remembered = build / "includes-good.txt"
    good = set(remembered.read_text().split()) if remembered.exists() else set()
    due = [path for path in sorted(files) if stamps[path] not in good]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        messages = dict(zip(due, pool.map(lambda path: compiles(path, files[path], build), due)))
    remembered.write_text("\n".join(sorted(good | {stamps[path] for path in due if not messages[path]})) + "\n")
    problems += [f"{path.relative_to(ROOT)} does not compile alone:\n{message}"
                 for path, message in messages.items() if message]
    print("\n".join(problems + [f"{len(headers)} headers, {len(files)} files to compile, {len(due)} of them new"]))
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
