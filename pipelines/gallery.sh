#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# The pictures of docs/gallery.md: the figure in scene=builtin:apartment, beside the path-traced truth where
# he keeps the studio's light, and how it changes by light, lights and nodes of the elements.
#   pipelines/gallery.sh [--samples N]
#     --samples N     paths of a pixel of the truth; default 48
# Writes out/gallery/*.jpg and prints how far each picture is from its truth.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
polyhull_help "$@"

samples=48
if [ $# -gt 0 ]; then
  [ "$1" = --samples ] && [[ ${2:-} =~ ^[1-9][0-9]*$ ]] && [ $# -eq 2 ] ||
    fail "unknown arguments '$*'; usage: pipelines/gallery.sh [--samples N]"
  samples=$2
fi
polyhull_programs polyhull-truth
polyhull_environment
out=$polyhull_source/out/gallery
mkdir -p "$out"
width=640 height=360

# shot NAME SECOND OF-MESH OF-COMPOSITE EYE TARGET NODES LIGHTS: out/gallery/NAME.png
shot() {
  local index cameras=() changes=()
  [ -z "$7" ] || changes+=(nodes="$7")
  [ -z "$8" ] || changes+=(lights="$8")
  for index in 0 1 2 3; do
    cameras+=(rigtestsrc camera="cam$index" num-buffers=1 start="$2" ! silhouette camera="cam$index" ! hull.)
  done
  # shellcheck disable=SC2086
  gst-launch-1.0 "${cameras[@]}" hullbuild name=hull ! hullrefine ! hulltexture ! composite.mesh_0 \
    scenesrc num-buffers=1 scene=builtin:apartment eye="$5" target="$6" "${changes[@]}" ! \
    video/x-raw,width=$width,height=$height ! composite.background \
    composite name=composite $3 $4 ! videoconvert ! pngenc ! filesink location="$out/$1.png" >"$out/$1.log" ||
    fail "$1: $(cat "$out/$1.log")"
}

# beside_truth NAME PLACE SECOND EYE TARGET NODES LIGHTS: out/gallery/NAME.jpg, picture and truth
beside_truth() {
  # shellcheck disable=SC2086
  polyhull-truth "$out/$1.png" --scene builtin:apartment --place $2 --seconds "$3" --eye ${4//,/ } --target ${5//,/ } \
    --nodes "$6" --lights "$7" --shrink 1 --samples "$samples" -o "$out/$1-truth.png" | sed "s/^/$1: /"
  gst-launch-1.0 filesrc location="$out/$1-truth.png" ! pngdec ! videocrop bottom=$height ! videoconvert ! \
    jpegenc quality=80 ! filesink location="$out/$1.jpg" >/dev/null
}

# in_rows NAME COLUMNS PICTURE...: out/gallery/NAME.jpg
in_rows() {
  local name=$1 columns=$2 parts=() pads=() index=0 picture
  shift 2
  for picture in "$@"; do
    parts+=(filesrc location="$out/$picture.png" ! pngdec ! row.)
    pads+=("sink_$index::xpos=$((index % columns * width))" "sink_$index::ypos=$((index / columns * height))")
    index=$((index + 1))
  done
  gst-launch-1.0 compositor name=row "${pads[@]}" ! videoconvert ! jpegenc quality=80 ! \
    filesink location="$out/$name.jpg" "${parts[@]}" >/dev/null
}

say "the mirror on the wall, and the floor that it shows"
eye=-1.2,1.5,2.6 target=-0.5,1.0,-0.8
shot mirror 0 "" mirror-depth=2 $eye $target "" ""
beside_truth mirror "0 0 0" 0 $eye $target "" ""

say "behind a door that is half open"
eye=1.9,1.55,0.9 target=-3.2,1.1,-0.15 door="door turn=0,50,0"
shot door 1 "mesh_0::translate-x=-3.8" "" $eye $target "$door" ""
beside_truth door "-3.8 0 0" 1 $eye $target "$door" ""

say "the door opens and he comes in"
step=0
for turn in 0 40 80 105; do
  shot "in-$step" $step "mesh_0::translate-x=-3.$((9 - 2 * step)) mesh_0::light=relit" "" $eye $target \
    "door turn=0,$turn,0" ""
  step=$((step + 1))
done
in_rows film 2 in-0 in-1 in-2 in-3

say "the same place in three lights"
eye=2.2,1.5,1.7 target=-1.4,1.0,-0.3
index=0
for lights in "" "lamp intensity=0.06; 2 intensity=3" "lamp colour=0.3,0.5,1 intensity=0.5"; do
  for light in off relit; do
    shot "$light-$index" 2.5 "mesh_0::translate-x=-1.6 mesh_0::light=$light" "" $eye $target "door turn=0,105,0" "$lights"
  done
  index=$((index + 1))
done
in_rows lights 3 off-0 off-1 off-2 relit-0 relit-1 relit-2
rm -f "$out"/*.log
say "made, $SECONDS s from the start:"
ls -l "$out"/*.jpg
