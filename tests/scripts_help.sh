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
  output=$(timeout 60 "$source_folder/$script" "$@" 2>&1)
  got=$?
  if [ "$got" -ne "$status" ] || [[ $output != *"$word"* ]] || [[ $output == *"==>"* ]]; then
    printf 'FAILED %s %s: status %s, expected %s and "%s"\n%s\n' "$script" "$*" "$got" "$status" "$word" "$output"
    failures=$((failures + 1))
  fi
}

for script in pipelines/{cameras-aravis,cameras-v4l2,capture,demo,record,room,server,turntable}.sh pipelines/send-{scene,track}.py tests/{gpu,mutants,run}.sh; do
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
expect 1 "usage" tests/gpu.sh
expect 0 "element-gaussblur" tests/nearest.py "${POLYHULL_BUILD:?}" 1 plugins/gaussblur/gaussblur.cpp
rig=$source_folder/pipelines/rigs/five.json
for script in pipelines/cameras-{aravis,v4l2}.sh; do
  expect 1 "--rig FILE says" "$script"
  expect 1 "no-such.json' does not exist" "$script" --rig no-such.json
  expect 1 "names 1 cameras; expected 2 to 16" "$script" --rig "$rig" --cameras cam0=a
  expect 1 "'cam0' twice" "$script" --rig "$rig" --cameras "cam0=a cam0=b"
  expect 1 "no camera 'cam9'" "$script" --rig "$rig" --cameras "cam0=a cam9=b"
  expect 1 "expected NAME=ADDRESS" "$script" --rig "$rig" --cameras "cam0=a cam1"
  expect 1 "unknown argument '--secnods'" "$script" --rig "$rig" --secnods 3
  expect 1 "--exposure is 'long'" "$script" --rig "$rig" --cameras "cam0=a cam1=b" --exposure long
done
expect 1 "--camera NAME says" pipelines/capture.sh
expect 1 "--source says what" pipelines/capture.sh --camera cam0
expect 1 "who gives the clock" pipelines/capture.sh --camera cam0 --source videotestsrc
expect 1 "--port is '0'" pipelines/capture.sh --camera cam0 --source videotestsrc --server a --port 0
expect 1 "unknown argument '--secnods'" pipelines/capture.sh --secnods 3
expect 0 "polyhull-run --clock a:7480 videotestsrc" \
  pipelines/capture.sh --camera cam0 --source videotestsrc --server a --dry-run
expect 1 "--settings needs --certificate" pipelines/capture.sh --camera cam0 --source videotestsrc --server a --settings --dry-run
expect 1 "--rig FILE says" pipelines/server.sh
expect 1 "no-such.json' does not exist" pipelines/server.sh --rig no-such.json
expect 1 "names 1 cameras; expected 2 to 64" pipelines/server.sh --rig "$rig" --cameras cam0=a
expect 1 "'cam0' twice" pipelines/server.sh --rig "$rig" --cameras "cam0=a cam0=b"
expect 1 "no camera 'cam9'" pipelines/server.sh --rig "$rig" --cameras "cam0=a cam9=b"
expect 1 "--max-wait is 'long'" pipelines/server.sh --rig "$rig" --cameras "cam0=a cam1=b" --max-wait long
expect 0 "name=cam1 camera=cam1 host=b port=9 max-rate=200000000" \
  pipelines/server.sh --rig "$rig" --cameras "cam0=a cam1=b:9" --dry-run
expect 0 "host=fd00::5 port=9 max-rate" \
  pipelines/server.sh --rig "$rig" --cameras "cam0=[fd00::5]:9 cam1=[fd00::6]" --dry-run
expect 1 "an IPv6 address needs brackets" pipelines/server.sh --rig "$rig" --cameras "cam0=fd00::5 cam1=b"
expect 1 "--clock is 'ntp'" pipelines/server.sh --rig "$rig" --cameras "cam0=a cam1=b" --clock ntp
expect 0 "polyhull-run --clock ptp:5 hullbuild" \
  pipelines/server.sh --rig "$rig" --cameras "cam0=a cam1=b" --clock ptp:5 --dry-run
expect 0 "polyhull-run --clock ptp videotestsrc" \
  pipelines/capture.sh --camera cam0 --source videotestsrc --server ptp --dry-run
expect 0 "polyhull-run --clock ptp:5 videotestsrc" \
  pipelines/capture.sh --camera cam0 --source videotestsrc --server ptp:5 --dry-run
expect 1 "--stamp needs --trigger" pipelines/server.sh --rig "$rig" --cameras "cam0=a cam1=b" --stamp delay=0
expect 0 "serialtrigger device=/dev/ttyS0 rate=25/1 viewclientsrc name=cam0 camera=cam0 host=a port=7481 max-rate=200000000 \\! queue \\! viewdecode \\! triggerstamp delay=20000000 \\! queue" \
  pipelines/server.sh --rig "$rig" --cameras "cam0=a cam1=b" --trigger "device=/dev/ttyS0 rate=25/1" --stamp delay=20000000 --dry-run
expect 1 "--silhouette needs --certificate" pipelines/server.sh --rig "$rig" --cameras "cam0=a cam1=b" --silhouette sigma=1
expect 0 'clock \[fd00::1\]:7480 videotestsrc' \
  pipelines/capture.sh --camera cam0 --source videotestsrc --server "[fd00::1]" --dry-run
expect 1 "say which with --trigger" pipelines/cameras-aravis.sh --rig "$rig" --cameras "cam0=a cam1=b" --pulses /dev/ttyS0
expect 1 "there is no device /no/camera" pipelines/cameras-v4l2.sh --rig "$rig" --cameras "cam0=/no/camera cam1=/no/other"

# The pipelines build a release.
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
