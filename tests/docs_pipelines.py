#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs every shell example of the documents as printed: each ```sh fence of README.md and docs/.

A fence whose first line is `# not run: REASON` is left out and listed. Each one runs in an empty folder
of its own with `bash -e`; commands that the documents say run for ever are bounded by `timeout` there.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(os.environ["POLYHULL_SOURCE"])
TIMEOUT = int(os.environ.get("POLYHULL_DOCS_TIMEOUT", "120"))


def fences():
    for path in [SOURCE / "README.md", *sorted((SOURCE / "docs").rglob("*.md"))]:
        if path.name.endswith(".in.md"):
            continue  # part of the page that is made from it
        text = path.read_text()
        for match in re.finditer(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            line = text.count("\n", 0, match.start()) + 1
            yield path.relative_to(SOURCE), line, match.group(1)


def run(code):
    with tempfile.TemporaryDirectory() as folder:
        data = pathlib.Path(os.environ.get("POLYHULL_DATA", ""))
        environment = dict(os.environ, POLYHULL_SOURCE=str(SOURCE))
        if data.is_dir():
            (pathlib.Path(folder) / "data").symlink_to(data.resolve())
        return subprocess.run(["bash", "-e", "-o", "pipefail", "-c", code], cwd=folder,
                              env=environment, stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, timeout=TIMEOUT)


def main():
    wanted = sys.argv[1] if len(sys.argv) > 1 else ""
    failures = passed = 0
    for path, line, code in fences():
        where = f"{path}:{line}"
        if wanted and wanted not in where:
            continue
        reason = re.match(r"# not run: (.*)", code)
        if reason:
            print(f"left out {where}: {reason.group(1)}")
            continue
        if re.search(r"(^|[ =\"'])data/", code) and not pathlib.Path(
                os.environ.get("POLYHULL_DATA", "")).is_dir():
            print(f"skipped {where}: the real input is not here")
            continue
        try:
            result = run(code)
            if result.returncode == 0:
                passed += 1
                print(f"ok {where}")
                continue
            output = result.stdout + result.stderr
        except subprocess.TimeoutExpired:
            output = f"still running after {TIMEOUT} s"
        failures += 1
        print(f"FAILED {where}\n{code}\n{output}")
    print(f"{passed} examples ran, {failures} failed")
    return 1 if failures or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
