#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# A real person in an ordinary room, without any screen: four videos keyed against pictures of the empty
# room, strong lens distortion, all frames, composited over the built-in scene.
#   pipelines/room.sh FOLDER
# FOLDER holds cam1 ... cam4 with video.avi and background.avi, and calibration_resolved.txt.
# Writes out/room.mp4, out/room.png (contact sheet), out/room.glb and prints how well the hull fills each
# camera's mask in frames 40, 200 and 400.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
polyhull_help "$@"

[ $# -eq 1 ] || fail "usage: pipelines/room.sh FOLDER"
[ -f "$1/calibration_resolved.txt" ] || fail "'$1' does not hold calibration_resolved.txt"
folder=$(cd "$1" && pwd)

polyhull_programs polyhull-rig polyhull-report polyhull-run
polyhull_environment
out=$polyhull_source/out
mkdir -p "$out/room-meshes"
rm -f "$out"/room-meshes/*

# Millimetres, z down, floor at z = 0.
polyhull-rig import text "$folder/calibration_resolved.txt" --size 644x486 \
  --bounds -50 -450 -1450 750 680 0 --up 0 0 -1 --unit mm -o "$out/room.json"

say "taking pictures of the empty room"
cameras=""
for number in 1 2 3 4; do
  camera=cam$number
  gst-launch-1.0 filesrc location="$folder/$camera/background.avi" ! avidemux ! avdec_mpeg4 ! \
    videoconvert ! pngenc snapshot=true ! filesink location="$out/room-plate$number.png"
  # The recordings lack two frames each, not the same ones: videorate repeats the one before.
  cameras+=" filesrc location=$folder/$camera/video.avi ! avidemux ! avdec_mpeg4 ! videorate !
    video/x-raw,framerate=50/1 ! queue max-size-buffers=4 !
    chromamatte method=difference clean-plate=$out/room-plate$number.png
      shadow-darkest=0.5 difference-low=10 difference-high=28 close=4 choke=0.5 rig=$out/room.json camera=$camera !
    gaussblur sigma=2 ! contourfind camera=$camera tolerance=0.7 keep-largest=1 min-hole-area=100 ! hull."
done

say "building a hull for every frame and setting it into the room"
# shellcheck disable=SC2086
polyhull-run --json "$out/room-figures.json" $cameras \
  hullbuild name=hull rig="$out/room.json" ! hulltexture ! tee name=meshes \
  meshes. ! queue max-size-buffers=4 ! multifilesink async=false location="$out/room-meshes/%03d.mesh" \
  meshes. ! queue max-size-buffers=4 ! composite.mesh_0 \
  scenesrc path=orbit orbit-speed=20 target-y=0.75 num-buffers=214 ! \
  video/x-raw,width=1280,height=720,framerate=25/1 ! queue max-size-buffers=4 ! composite.background \
  composite name=composite mesh_0::translate-x=-0.35 mesh_0::translate-z=-0.1 ! tee name=pictures \
  pictures. ! queue ! x264enc speed-preset=veryfast ! h264parse ! mp4mux ! \
  filesink async=false location="$out/room.mp4" \
  pictures. ! queue ! videorate drop-only=true ! video/x-raw,framerate=1/2 ! videoconvert ! pngenc ! \
  multifilesink async=false location="$out/room-%d.png"

say "how the hull fills the masks"
polyhull-report coverage "$out"/room-meshes/{040,200,400}.mesh --json "$out/room-coverage.json"
meshes=("$out"/room-meshes/*.mesh)
say "${#meshes[@]} hulls, each checked:"
polyhull-report closed "${meshes[@]}"

cp "$out/room-meshes/200.mesh" "$out/room.mesh"
gst-launch-1.0 filesrc location="$out/room.mesh" blocksize=1073741824 ! \
  application/x-polyhull-mesh ! hullexport location="$out/room.glb"
polyhull-report sheet "$out/room.mesh" -o "$out/room.png" \
  --composite "$out/room-0.png" --composite "$out/room-1.png" \
  --composite "$out/room-2.png" --composite "$out/room-3.png"
rm -rf "$out"/room-[0-9].png "$out/room-meshes"

say "made:"
ls -l "$out"/room.{mp4,png,glb,mesh,json} "$out/room-coverage.json" "$out/room-figures.json"
