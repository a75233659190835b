# SPDX-License-Identifier: LGPL-2.1-or-later
"""Prints the given headers of this folder and all headers of it that they include.

usage: included_headers.py HEADER..."""
import pathlib
import re
import sys

LIB = pathlib.Path(__file__).resolve().parent


def included(headers):
    found, left = set(), list(headers)
    while left:
        header = left.pop()
        if header in headers and not (LIB / header).is_file():
            sys.exit(f"there is no header {LIB / header}")
        if header not in found and (LIB / header).is_file():
            found.add(header)
            left += re.findall(r'^#include "([^"]+)"', (LIB / header).read_text(), re.M)
    return sorted(found)


if __name__ == "__main__":
    print("\n".join(included(sys.argv[1:])))
