#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whether a program that embeds the core library can include each public header that docs/embedding.md names, by
what pkg-config says and nothing else than is installed.

usage: installed_headers.py BUILD-FOLDER"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def main():
    build = sys.argv[1]
    named = re.findall(r"^\| `([\w/]+\.h)`", (ROOT / "docs" / "embedding.md").read_text(), re.M)
    meant = re.search(r"^public_headers = \[(.*?)\]", (ROOT / "lib" / "meson.build").read_text(), re.M | re.S)
    if not named or named != re.findall(r"'(.*)'", meant.group(1)):
        print("docs/embedding.md and public_headers of lib/meson.build name different headers, or in another order")
        return 1
    with tempfile.TemporaryDirectory() as root:
        subprocess.run(["meson", "install", "-C", build, "--no-rebuild", "--quiet", "--tags", "devel", "--destdir", root],
                       check=True)
        description = next(pathlib.Path(root).rglob("polyhull.pc"))
        flags = subprocess.run(["pkg-config", "--cflags", "polyhull"], capture_output=True, text=True, check=True,
                               env=dict(os.environ, PKG_CONFIG_PATH=str(description.parent))).stdout.split()
        flags = [flag.replace("-I", "-I" + root, 1) if (pathlib.Path(root) / flag[3:]).is_dir() else flag for flag in flags]
        program = "".join(f'#include "{header}"\n' for header in named)
        result = subprocess.run(["c++", "-std=c++20", "-fsyntax-only", "-x", "c++", "-", *flags], input=program, text=True,
                                cwd=root)
    print(f"{len(named)} public headers")
    return result.returncode


if __name__ == "__main__":
    sys.exit(main())
