#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# The example that reads meshes in Python, as its header says: readers from both schemas, then the script
# (run by the interpreter that is the argument). Every hull it prints is closed and has four views.
set -euo pipefail
if ! "$1" -c 'import flatbuffers' 2>/dev/null; then
  echo "python3-flatbuffers is not installed"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
flatc --python -o "$folder" "$POLYHULL_SOURCE"/lib/wire/{view,mesh}.fbs
output=$(PYTHONPATH=$folder "$1" "$POLYHULL_SOURCE/docs/examples/read_hull.py")
echo "$output"
[ "$(grep -c 'triangles, closed, 0\.0[89][0-9]* m3' <<<"$output")" -eq 2 ]
[ "$(grep -c '  cam[0-3]: 1024x768, .* RGBA ([0-9]*, [0-9]*, [0-9]*, 255)' <<<"$output")" -eq 8 ]
