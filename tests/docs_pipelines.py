#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs every shell example of the documents as printed: each ```sh fence of README.md and docs/; and looks
up every setting that the text names as `ELEMENT PROPERTY=VALUE`: the element must take it.

A fence whose first line is `# not run: REASON` is left out and listed. Each one runs in an empty folder
of its own with `bash -e`, two at a time; commands that the documents say run for ever are bounded by `timeout` there.
"""
import concurrent.futures
import contextlib
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time

SOURCE = pathlib.Path(os.environ["POLYHULL_SOURCE"])
TIMEOUT = int(os.environ.get("POLYHULL_DOCS_TIMEOUT", "120"))
PORTS = threading.Lock()  # of the network and of real time, one example at a time


def documents():
    for path in [SOURCE / "README.md", *sorted((SOURCE / "docs").rglob("*.md"))]:
        if not path.name.endswith(".in.md"):  # part of the page that is made from it
            yield path, path.read_text()


def fences():
    for path, text in documents():
        for match in re.finditer(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            line = text.count("\n", 0, match.start()) + 1
            yield path.relative_to(SOURCE), line, match.group(1)


def refusal(element, name, value):
    """Why ELEMENT would not take NAME=VALUE, by its page (which another test holds against the code)."""
    page = (SOURCE / "docs" / "elements" / f"{element}.md").read_text()
    if "::" in name:
        name = name.split("::")[1]
        row = re.search(rf"^ +{name} +: .*\n.*flags:.*\n.*$", page, re.MULTILINE)
    else:
        row = re.search(rf"^\| `{name}` \|.*$", page, re.MULTILINE)
    if not row:
        return f"{element} has no property {name}"
    nicks = re.findall(r"<br>`([^`]+)`:", row.group())
    if nicks and value not in nicks:
        return f"{element}: {name} takes {', '.join(nicks)}, not {value}"
    limits = re.search(r"Range:\s+(\S+)\s+-\s+(\S+)", row.group())
    if limits:
        number = int(value, 16) if value.startswith("0x") else float(value)
        if not float(limits.group(1)) <= number <= float(limits.group(2)):
            return f"{element}: {name} takes {limits.group(1)} to {limits.group(2)}, not {value}"
    return None


def check_settings():
    """How many settings the text names, and how many of them no element takes."""
    count = wrong = 0
    for path, text in documents():
        for match in re.finditer(r"`([a-z]+)((?: [\w:-]+=[^\s`]+)+)`", text):
            if not (SOURCE / "docs" / "elements" / f"{match.group(1)}.md").exists():
                continue
            for setting in match.group(2).split():
                count += 1
                problem = refusal(match.group(1), *setting.split("=", 1))
                if problem:
                    wrong += 1
                    print(f"FAILED {path.relative_to(SOURCE)}: {match.group()}: {problem}")
    return count, wrong


def run(code):
    with tempfile.TemporaryDirectory() as folder:
        data = pathlib.Path(os.environ.get("POLYHULL_DATA", ""))
        environment = dict(os.environ, POLYHULL_SOURCE=str(SOURCE))
        if data.is_dir():
            (pathlib.Path(folder) / "data").symlink_to(data.resolve())
        # Without sources beside them the scripts take themselves for installed: they build nothing.
        (pathlib.Path(folder) / "pipelines").symlink_to(SOURCE / "pipelines")
        return subprocess.run(["bash", "-e", "-o", "pipefail", "-c", code], cwd=folder,
                              env=environment, stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, timeout=TIMEOUT)


def outcome(fence):
    """What to say of an example, and whether it ran (None: it was left out)."""
    path, line, code = fence
    where = f"{path}:{line}"
    reason = re.match(r"# not run: (.*)", code)
    if reason:
        return f"left out {where}: {reason.group(1)}", None
    if re.search(r"(^|[ =\"'])data/", code) and not pathlib.Path(os.environ.get("POLYHULL_DATA", "")).is_dir():
        return f"skipped {where}: the real input is not here", None
    try:
        with PORTS if re.search(r"\bport\b|server|client|udp|tcp|srt|--live|is-live", code) else contextlib.nullcontext():
            began = time.monotonic()
            result = run(code)
        if result.returncode == 0:
            return f"ok {where}, {time.monotonic() - began:.1f} s", True
        output = result.stdout + result.stderr
    except subprocess.TimeoutExpired:
        output = f"still running after {TIMEOUT} s"
    return f"FAILED {where}\n{code}\n{output}", False


def main():
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    settings, failures = check_settings()
    print(f"{settings} settings looked up, {failures} wrong")
    passed = 0
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for text, ran in pool.map(outcome, [fence for fence in fences() if wanted in f"{fence[0]}:{fence[1]}"]):
            print(text, flush=True)
            passed += ran is True
            failures += ran is False
    print(f"{passed} examples ran, {failures} failed")
    return 1 if failures or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
