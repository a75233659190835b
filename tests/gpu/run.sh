#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs what tests/gpu.sh has packed beside this script, on this machine's GPU.
#   run.sh [OUTPUT]    OUTPUT: a folder for logs and tables; default: a new one
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
output=${1:-$(mktemp -d)}
mkdir -p "$output"
unpacked=$(mktemp -d)
trap 'rm -rf "$unpacked"' EXIT
tar -C "$unpacked" -xzf "$here/packed.tar.gz" || exit 1

export LD_LIBRARY_PATH=$unpacked/lib
ldconfig -p | grep -q libEGL.so.1 || LD_LIBRARY_PATH+=:$unpacked/glvnd
# Drivers that the loader does not look for, as in containers.
if [ -z "${__EGL_VENDOR_LIBRARY_FILENAMES:-}" ]; then
  for vendor in /usr/share/glvnd /etc/glvnd /usr/local/*/share/glvnd; do
    for file in "$vendor"/egl_vendor.d/*.json; do
      [ -f "$file" ] && ! grep -q mesa "$file" && export __EGL_VENDOR_LIBRARY_FILENAMES=$file
    done
  done
fi

"$unpacked/picture_benchmark" --device || exit 1
failed=0
while read -r program cases; do
  name=${cases:-$program}
  began=$SECONDS
  timeout 200 "$unpacked/tests/$program" $cases >"$output/$name.log" 2>&1 </dev/null
  status=$?
  echo "$name: status $status, $((SECONDS - began)) s, $(grep -c '\[       OK' "$output/$name.log") passed, $(grep -cE '^\[  FAILED  \] .*\(' "$output/$name.log") failed, $(grep -cE '^\[  SKIPPED \] .*\(' "$output/$name.log") skipped"
  [ "$status" -eq 0 ] || { failed=$((failed + 1)); grep -E '^\[  FAILED|Failure|error:' -A 6 "$output/$name.log" | head -n 40; }
done <"$unpacked/tests.txt"
for size in 1280x720 1920x1080 3840x2160; do
  echo "$size"
  "$unpacked/picture_benchmark" --size $size --rounds 10 --output "$output" "$unpacked"/meshes/*.bin | tee "$output/picture-$size.txt" ||
    failed=$((failed + 1))
  mv "$output/picture.csv" "$output/picture-$size.csv"
done
echo "$failed failed"
[ "$failed" -eq 0 ]
