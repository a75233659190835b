#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Records what the cameras of a rig see of the synthetic figure, one file per camera, so that the rest
# of the chain can be measured or repeated without drawing the pictures again. Starts from a bare Debian 12.
#   pipelines/record.sh [--rig FILE] [--cameras "A B C"] [--seconds N] [--rate N] [--codec y4m|ffv1]
#                       [--truth] [FOLDER]
#     --rig FILE      the rig; default: the built-in one
#     --cameras "..." names of its cameras; default: "cam0 cam1 cam2 cam3"
#     --seconds N     length, default 4
#     --rate N        frames per second, default 25
#     --codec y4m     uncompressed (default): reading costs next to nothing; 30 MB per camera and second
#     --codec ffv1    lossless in Matroska, about a third of that, slower to read
#     --truth         also the subject's true surface per frame (truth/mesh-00000.ply ...) and mattes
# Writes FOLDER/NAME.y4m or FOLDER/NAME.mkv for each camera, and FOLDER/rig.json for hullbuild; default
# folder: out/recording.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
polyhull_help "$@"

rig="" cameras="cam0 cam1 cam2 cam3" seconds=4 rate=25 codec=y4m truth=false folder=""
usage="usage: pipelines/record.sh [--rig FILE] [--cameras \"A B\"] [--seconds N] [--rate N] [--codec y4m|ffv1] [--truth] [FOLDER]"
while [ $# -gt 0 ]; do
  case $1 in
    --rig) rig=${2:?--rig needs a file}; shift ;;
    --cameras) cameras=${2:?--cameras needs names}; shift ;;
    --seconds) seconds=${2:?--seconds needs a number}; shift ;;
    --rate) rate=${2:?--rate needs a number}; shift ;;
    --codec) codec=${2:?--codec needs y4m or ffv1}; shift ;;
    --truth) truth=true ;;
    -*) fail "unknown argument '$1'; $usage" ;;
    *) folder=$1 ;;
  esac
  shift
done
twice=$(tr -s ' ' '\n' <<<"$cameras" | sort | uniq -d | head -n 1)
[ -z "$twice" ] || fail "camera '$twice' is named twice: both recordings would be written to one file"
for number in "$seconds" "$rate"; do
  [[ $number =~ ^[0-9]+$ ]] && [ "$number" -gt 0 ] || fail "'$number' is no whole number above 0; $usage"
done
case $codec in
  y4m) store="y4menc" ending=y4m ;;
  ffv1) store="avenc_ffv1 ! matroskamux" ending=mkv ;;
  *) fail "unknown codec '$codec'; $usage" ;;
esac

polyhull_programs polyhull-rig
polyhull_environment

folder=${folder:-$polyhull_source/out/recording}
mkdir -p "$folder"
frames=$((seconds * rate))
caps="framerate=$rate/1"
say "recording $frames frames of: $cameras"
if [ -z "$rig" ]; then
  polyhull-rig export -o "$folder/rig.json"
elif ! [ "$rig" -ef "$folder/rig.json" ]; then
  cp "$rig" "$folder/rig.json"
fi
sources=()
for camera in $cameras; do
  sources+=(rigtestsrc ${rig:+rig="$rig"} "camera=$camera" "num-buffers=$frames" noise=2 spill=0.1 '!'
    "video/x-raw,format=I420,$caps" '!' queue max-size-buffers=2 '!')
  # shellcheck disable=SC2206
  sources+=($store '!' filesink "location=$folder/$camera.$ending")
done
gst-launch-1.0 "${sources[@]}"
if $truth; then
  mkdir -p "$folder/truth"
  first=true
  sources=()
  for camera in $cameras; do
    sources+=(rigtestsrc ${rig:+rig="$rig"} "camera=$camera" "num-buffers=$frames" output=matte)
    if $first; then sources+=("mesh-location=$folder/truth/mesh-%05d.ply"); fi
    first=false
    sources+=('!' "video/x-raw,$caps" '!' pngenc compression-level=1 '!'
      multifilesink "location=$folder/truth/$camera-%05d.png")
  done
  say "writing the truth"
  gst-launch-1.0 "${sources[@]}"
fi
say "recorded in $folder: $(du -sh "$folder" | cut -f1)"
if [ "$codec" = y4m ]; then
  say "read one back with: filesrc location=$folder/${cameras%% *}.y4m ! y4mdec"
else
  say "read one back with: filesrc location=$folder/${cameras%% *}.mkv ! matroskademux ! avdec_ffv1"
fi
