#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# All tracked C++ is formatted as .clang-format says. Versions of clang-format differ in what they make of it,
# so only version 14, Debian 12's, is asked; without it this is skipped.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1
version=14
formatter=$(command -v clang-format-$version || command -v clang-format)
if ! "${formatter:-false}" --version 2>/dev/null | grep -q "version $version\."; then
  echo "SKIPPED: there is no clang-format $version (Debian 12: apt-get install clang-format)"
  exit 77
fi
if ! git rev-parse --git-dir >/dev/null 2>&1; then
  echo "SKIPPED: this is no git checkout, whose tracked files are checked"
  exit 77
fi
if git ls-files -z '*.cpp' '*.h' '*.inc' | xargs -0 -P2 -n40 "$formatter" --dry-run --Werror; then
  echo ok
else
  echo "format them: $formatter -i FILE..."
  exit 1
fi
