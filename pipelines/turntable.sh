#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# A real object on a turntable, from still pictures to a hull in a room: keys the pictures themselves,
# builds the hull, and flies around it.
#   pipelines/turntable.sh FOLDER
# FOLDER is the Oxford dinosaur (images/viff.000.png ... on blue cloth, dino_Ps_metric.txt) or
# Middlebury's dinoSparseRing (dinoSR0001.png ... on black, dinoSR_par.txt).
# Writes out/NAME.mp4, out/NAME.png (contact sheet), out/NAME.glb and prints how well the hull fills the
# mask keyed in each view.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
polyhull_help "$@"

[ $# -eq 1 ] || fail "usage: pipelines/turntable.sh FOLDER"
[ -d "$1" ] || fail "folder '$1' does not exist"
folder=$(cd "$1" && pwd)

polyhull_programs polyhull-rig polyhull-report polyhull-run
polyhull_environment
out=$polyhull_source/out
mkdir -p "$out"

# What differs between the two: the calibration, the keying, and where the object stands in the room.
# `unit` is a whole metre per unit of the calibration, so many times life size that the toy is seen well.
if [ -f "$folder/dino_Ps_metric.txt" ]; then
  name=oxford_dino
  pictures=("$folder"/images/viff.*.png)
  polyhull-rig import pmatrices "$folder/dino_Ps_metric.txt" --size 720x576 --names viff.%03d \
    --bounds -0.07 -0.12 0.38 0.07 0.055 0.6 --up 0 0 -1 --unit 7 -o "$out/$name.json"
  # Dull blue cloth, so both colours are given; a dark border at the right edge, first and last rows.
  key="key=blue screen-colour=0x425270 foreground-colour=0x6e6862 clip-black=0.25 clip-white=0.9 roi-x=4 roi-y=6 roi-width=690 roi-height=562"
  contours="sigma=0.6 ! contourfind tolerance=0.25 min-area=400"
  place="mesh_0::translate-y=4.05"
elif [ -f "$folder/dinoSR_par.txt" ]; then
  name=middlebury_dino
  pictures=("$folder"/dinoSR0*.png)
  polyhull-rig import middlebury "$folder/dinoSR_par.txt" --size 640x480 \
    --bounds -0.061897 -0.018874 -0.057845 0.010897 0.068227 0.015495 --unit 15 \
    -o "$out/$name.json"
  # Black velvet: whatever differs from black, the dimly lit support below difference-low.
  key="method=difference key=colour key-colour=0x000000 difference-low=30 difference-high=60 close=5"
  contours="sigma=1 ! contourfind tolerance=0.25 keep-largest=1 min-hole-area=3000"
  place="mesh_0::translate-x=0.375 mesh_0::translate-y=0.283 mesh_0::translate-z=0.32"
else
  fail "'$folder' holds neither dino_Ps_metric.txt (Oxford) nor dinoSR_par.txt (Middlebury)"
fi
[ -f "${pictures[0]}" ] || fail "'$folder' holds no pictures (${pictures[0]} was expected)"

say "keying ${#pictures[@]} pictures and building the hull"
cameras=""
for picture in "${pictures[@]}"; do
  camera=$(basename "$picture" .png)
  cameras+=" filesrc location=$picture ! pngdec ! videoconvert ! imagefreeze num-buffers=1 !
    chromamatte $key rig=$out/$name.json camera=$camera !
    gaussblur $contours camera=$camera ! hull."
done
# shellcheck disable=SC2086
polyhull-run --quiet --brief $cameras hullbuild name=hull rig="$out/$name.json" ! hulltexture ! \
  tee name=meshes \
  meshes. ! queue ! filesink async=false location="$out/$name.mesh" \
  meshes. ! queue ! hullexport location="$out/$name.glb"
polyhull-report coverage "$out/$name.mesh" --json "$out/$name-coverage.json"

say "flying around it"
# shellcheck disable=SC2086
polyhull-run filesrc location="$out/$name.mesh" blocksize=1073741824 ! application/x-polyhull-mesh ! \
  composite.mesh_0 \
  scenesrc path=orbit orbit-speed=45 target-y=0.75 num-buffers=200 ! \
  video/x-raw,width=1280,height=720,framerate=25/1 ! queue max-size-buffers=2 ! composite.background \
  composite name=composite $place ! tee name=pictures \
  pictures. ! queue ! x264enc speed-preset=veryfast ! h264parse ! mp4mux ! \
  filesink async=false location="$out/$name.mp4" \
  pictures. ! queue ! videorate drop-only=true ! video/x-raw,framerate=1/2 ! videoconvert ! pngenc ! \
  multifilesink async=false location="$out/$name-%d.png"
polyhull-report sheet "$out/$name.mesh" -o "$out/$name.png" \
  --composite "$out/$name-0.png" --composite "$out/$name-1.png" \
  --composite "$out/$name-2.png" --composite "$out/$name-3.png"
rm -f "$out/$name"-[0-9].png

say "made:"
ls -l "$out/$name.mp4" "$out/$name.png" "$out/$name.glb" "$out/$name.mesh" "$out/$name-coverage.json"
