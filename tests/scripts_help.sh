#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Each script tells by --help what it does, ends well, and does nothing else; it refuses what it does not
# know, before it installs or builds anything.
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

for script in pipelines/{demo,record,room,turntable}.sh tests/run.sh; do
  for option in --help -h; do
    expect 0 "$script" "$script" "$option"
    expect 0 "$script" "$script" something "$option"
  done
done
expect 1 "named twice" pipelines/record.sh --cameras "cam0 cam1 cam0"
expect 1 "unknown argument" pipelines/record.sh --secnods 3
expect 1 "unknown argument" pipelines/demo.sh --secnods 3
expect 1 "unknown argument" tests/run.sh --quik
expect 1 "usage" pipelines/room.sh
expect 1 "usage" pipelines/turntable.sh
[ "$failures" -eq 0 ] && echo ok
