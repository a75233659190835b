#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Each script tells by --help what it does, ends well, and does nothing else; it refuses what it does not
# know, before it installs or builds anything. What users run is built optimised.
set -uo pipefail
source_folder=${POLYHULL_SOURCE:?}
failures=0

# expect STATUS WORD SCRIPT ARGUMENT...: it ends with STATUS, at once, and prints WORD.
expect() {
  local status=$1 word=$2 script=$3 output got
  shift 3
  output=$(timeout 20 "$source_folder/$script" "$@" 2>&1)
  got=$?
  if [ "$got" -ne "$status" ] || [[ $output != *"$word"* ]] || [[ $output == *"==>"* ]]; then
    printf 'FAILED %s %s: status %s, expected %s and "%s"\n%s\n' "$script" "$*" "$got" "$status" "$word" "$output"
    failures=$((failures + 1))
  fi
}

for script in pipelines/{demo,record,room,turntable}.sh tests/{run,mutants}.sh; do
  for option in --help -h; do
    expect 0 "$script" "$script" "$option"
    expect 0 "$script" "$script" something "$option"
  done
done
expect 1 "named twice" pipelines/record.sh --cameras "cam0 cam1 cam0"
expect 1 "unknown argument" pipelines/record.sh --secnods 3
expect 1 "unknown argument" pipelines/demo.sh --secnods 3
expect 1 "rigs of 4, 5 and 8" pipelines/demo.sh --cameras 6
expect 1 "unknown argument" tests/run.sh --quik
expect 1 "unknown argument" tests/mutants.sh --lits
expect 1 "no fault is called" tests/mutants.sh no-such-fault
expect 1 "usage" pipelines/room.sh
expect 1 "usage" pipelines/turntable.sh

# The pipelines build a release, in a folder that the tests' build does not share.
stubs=$(mktemp -d)
trap 'rm -rf "$stubs"' EXIT
for tool in meson ninja; do
  printf '#!/bin/sh\necho %s "$@"\n' "$tool" >"$stubs/$tool"
  chmod +x "$stubs/$tool"
done
built=$(PATH=$stubs:$PATH POLYHULL_BUILD_DIR=$stubs/none bash -c 'source "$0/pipelines/prepare.sh"; polyhull_programs' \
  "$source_folder")
if [[ $built != *"meson setup $stubs/none $source_folder"*"--buildtype=release"* ]]; then
  printf 'FAILED polyhull_programs asks for no release: %s\n' "$built"
  failures=$((failures + 1))
fi
folder=$(env -u POLYHULL_BUILD_DIR bash -c 'source "$0/pipelines/prepare.sh"; echo "$polyhull_build"' "$source_folder")
if [ "$folder" != "$source_folder/build-release" ]; then
  printf 'FAILED the pipelines build in %s, not in build-release\n' "$folder"
  failures=$((failures + 1))
fi
[ "$failures" -eq 0 ] && echo ok
