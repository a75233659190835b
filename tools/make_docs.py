#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Writes docs/elements/NAME.md for every element of the plugin: the hand-written NAME.in.md, then
pads and properties as gst-inspect-1.0 tells them, so that the pages cannot differ from the code.

    tools/make_docs.py            writes the pages (GST_PLUGIN_PATH must lead to the plugin)
    tools/make_docs.py --check    exits with 1 and names the pages that are out of date
"""
import argparse
import pathlib
import re
import subprocess
import sys

DOCS = pathlib.Path(__file__).resolve().parent.parent / "docs" / "elements"
INHERITED = {"name", "parent"}


def inspect(*arguments):
    return subprocess.run(["gst-inspect-1.0", "--no-colors", *arguments], check=True,
                          capture_output=True, text=True).stdout


def element_names():
    return re.findall(r"^\s+([a-z0-9]+): ", inspect("polyhull"), re.MULTILINE)


def section(text, title):
    """The lines under `title:` up to the next line that starts in the first column."""
    match = re.search(rf"^{title}:\n((?:[ \t]+.*\n|\n)*)", text, re.MULTILINE)
    return match.group(1) if match else ""


def properties(text):
    """[(name, blurb, flags, type line, [(value, nick, description)])]"""
    found = []
    for line in section(text, "Element Properties").splitlines() + \
            section(text, "Pad Properties").splitlines():
        head = re.match(r"^  ([a-z][a-z0-9-]*)\s*: (.*)$", line)
        if head:
            found.append([head.group(1), head.group(2), "", "", []])
            continue
        body = line.strip()
        if not found or not body:
            continue
        value = re.match(r"^\((-?\d+|0x[0-9a-f]+)\): (\S+)\s*-\s*(.*)$", body)
        if body.startswith("flags:"):
            found[-1][2] = body[len("flags:"):].strip()
        elif value:
            found[-1][4].append((value.group(2), value.group(3)))
        elif not found[-1][3]:
            found[-1][3] = re.sub(r"\s+", " ", body)
    return found


def property_table(rows):
    lines = ["| property | type, range, default | when it can change | what it is |",
             "|---|---|---|---|"]
    for name, blurb, flags, kind, values in rows:
        if name in INHERITED:
            continue
        if "changeable in NULL, READY, PAUSED or PLAYING state" in flags or "controllable" in flags:
            when = "live" + (", by a controller too" if "controllable" in flags else "")
        elif "changeable only in NULL or READY state" in flags:
            when = "in NULL or READY"
        else:
            when = "read only" if "writable" not in flags else "before start"
        if values:
            blurb += "<br>" + "<br>".join(f"`{nick}`: {text}" for nick, text in values)
        cells = [f"`{name}`", kind, when, blurb]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines)


def pad_list(text):
    return "\n".join(line for line in section(text, "Pad Templates").rstrip().splitlines())


def page(name):
    text = inspect(name)
    long_name = re.search(r"^\s+Long-name\s+(.*)$", text, re.MULTILINE).group(1)
    klass = re.search(r"^\s+Klass\s+(.*)$", text, re.MULTILINE).group(1)
    description = re.search(r"^\s+Description\s+(.*)$", text, re.MULTILINE).group(1)
    intro = DOCS / f"{name}.in.md"
    parts = [f"<!-- Made by tools/make_docs.py from {name}.in.md and the element itself. -->",
             f"# {name}", f"**{long_name}** ({klass}). {description}"]
    if intro.exists():
        parts.append(intro.read_text().strip())
    parts += ["## Pads", "```\n" + pad_list(text) + "\n```", "## Properties",
              property_table(properties(text))]
    return "\n\n".join(parts) + "\n"


def index(names):
    lines = ["# Elements", ""]
    for name in names:
        description = re.search(r"^\s+Description\s+(.*)$", inspect(name), re.MULTILINE).group(1)
        lines.append(f"- [{name}]({name}.md): {description}")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    names = element_names()
    pages = {DOCS / f"{name}.md": page(name) for name in names}
    pages[DOCS / "README.md"] = index(names)
    stale = [path for path, text in pages.items()
             if not path.exists() or path.read_text() != text]
    if check:
        for path in stale:
            print(f"{path} is out of date: run tools/make_docs.py")
        return 1 if stale else 0
    for path in stale:
        path.write_text(pages[path])
        print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
