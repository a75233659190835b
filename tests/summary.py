#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""What meson's logs of several test runs say together: the times of the slowest tests, what was skipped inside
programs that passed, which checks failed, and last "N passed, N failed, N skipped". Its status is 1 where one failed
or a log is empty.

usage: summary.py LOG.json..."""
import collections
import json
import pathlib
import re
import sys

SLOW = 20.0  # seconds
# GoogleTest's and other programs' lines, with the reason where it stands in the line; gst-check's of what failed.
SKIPPED = re.compile(r"^(\[  SKIPPED \] .* \(.*|SKIPPED: .*)$", re.M)
FAILED = re.compile(r"^([^ \n]+:\d+:[EF]:.*|\[  FAILED  \] .* \(.*)$", re.M)


def results_of(log):
    return [json.loads(line) for line in pathlib.Path(log).read_text().splitlines()]


def name_of(result):
    return result["name"].split(" / ")[-1]


def print_times(log, results):
    passed = [result for result in results if result["result"] == "OK"]
    slow = sorted((result for result in passed if result["duration"] >= SLOW), key=lambda result: -result["duration"])
    print(f"{pathlib.Path(log).stem}: {len(passed)} passed, {sum(result['duration'] for result in passed):.0f} s in all")
    for result in slow:
        print(f"  {result['duration']:6.1f} s  {name_of(result)}")


def main():
    counts = collections.Counter()
    skipped, failed = [], []
    for log in sys.argv[1:]:
        results = results_of(log)
        print_times(log, results)
        if not results:
            failed.append(f"{log} is empty")
        for result in results:
            text = result.get("stdout", "") + result.get("stderr", "")
            kind = {"OK": "passed", "EXPECTEDFAIL": "passed", "SKIP": "skipped"}.get(result["result"], "failed")
            counts[kind] += 1
            skipped += [f"{name_of(result)}: {line}" for line in SKIPPED.findall(text)]
            if kind == "failed":
                failed.append(f"{name_of(result)}: {result['result']} after {result['duration']:.0f} s, {log}")
                failed += [f"  {line}" for line in FAILED.findall(text)]
    for title, lines in ("What was skipped inside programs:", skipped), ("What failed:", failed):
        if lines:
            print(title, *lines, sep="\n  ")
    print(f"{counts['passed']} passed, {counts['failed']} failed, {counts['skipped']} skipped")
    return 1 if failed or not counts else 0


if __name__ == "__main__":
    sys.exit(main())
