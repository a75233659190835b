#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Records views as takes, packs them in every way and prints the table of docs/benchmarks-network.md.
#   tests/benchmarks/coding.sh BUILD_FOLDER     (in a `meson devenv`)
# Synthetic views of a noisy camera; real ones of a person in a room where POLYHULL_DATA holds
# utrecht_voxel.
set -euo pipefail
[ $# -eq 1 ] || { echo "usage: coding.sh BUILD_FOLDER" >&2; exit 2; }
build=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
takes=("$folder/synthetic.take")
gst-launch-1.0 -q rigtestsrc camera=cam0 noise=3 num-buffers=100 ! silhouette camera=cam0 ! \
  takesink location="${takes[0]}"
room=${POLYHULL_DATA:-}/utrecht_voxel
if [ -f "$room/cam1/video.avi" ]; then
  gst-launch-1.0 -q filesrc location="$room/cam1/background.avi" ! avidemux ! avdec_mpeg4 ! \
    videoconvert ! pngenc snapshot=true ! filesink location="$folder/plate.png"
  takes+=("$folder/real.take")
  gst-launch-1.0 -q filesrc location="$room/cam1/video.avi" ! avidemux ! avdec_mpeg4 ! \
    identity eos-after=100 ! chromamatte method=difference clean-plate="$folder/plate.png" \
    shadow-darkest=0.5 difference-low=10 difference-high=28 close=4 choke=0.5 ! gaussblur sigma=2 ! \
    contourfind camera=cam1 keep-largest=1 min-hole-area=100 ! takesink location="${takes[1]}"
else
  echo "no real views: POLYHULL_DATA does not hold utrecht_voxel"
fi
"$build/tests/benchmarks/coding_benchmark" "${takes[@]}"
"$build/tests/benchmarks/h264_benchmark" "${takes[@]}"
