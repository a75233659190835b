#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The times of the tests in meson's logs, the slowest first: the table that tests/run.sh ends with.

usage: times.py LEAST-SECONDS LOG.json..."""
import json
import pathlib
import sys


def seconds(log):
    """Of each test that passed, by its name."""
    results = map(json.loads, pathlib.Path(log).read_text().splitlines())
    return {result["name"].split(" / ")[-1]: result["duration"] for result in results if result["result"] == "OK"}


def main():
    least, logs = float(sys.argv[1]), sys.argv[2:]
    for log in logs:
        times = seconds(log)
        slow = sorted(((time, name) for name, time in times.items() if time >= least), reverse=True)
        print(f"{pathlib.Path(log).name}: {len(times)} passed, {sum(times.values()):.0f} s in all; "
              f"those of {least:g} s and more take {sum(time for time, _ in slow):.0f} s:")
        for time, name in slow:
            print(f"  {time:6.1f} s  {name}")


if __name__ == "__main__":
    main()
