#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# The whole chain on a synthetic stage: a few cameras see a moving figure before a green screen; the
# figure is keyed, traced, turned into a textured hull and set into a ray-traced room, seen from a
# viewpoint that travels around it. Starts from a bare Debian 12.
#   pipelines/demo.sh [--cameras 4|5|8] [--live [--sink ELEMENT]] [--seconds N] [--truth] [--measure] [--all]
#     --cameras N     4 (default): the built-in rig; 5 or 8: pipelines/rigs/five.json, eight.json
#     --live          show it live, 640x360 at 10 frames/s, in a window instead of writing files
#     --sink ELEMENT  where --live shows it, for example "fakesink sync=true" where there is no display;
#                     default: autovideosink
#     --seconds N     length of the stream; default 10, live until it is stopped
#     --truth         hold two composites against the path-traced truth
#     --measure       measure the whole chain from recorded files
#     --all           build everything that an install has, not what the demo needs alone
# Writes out/demo.mp4, out/demo.png (contact sheet), out/hull.glb, out/demo.json (figures), with --truth
# out/demo-truth-*.png (composite beside the truth), with --measure out/demo-recorded.json.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
polyhull_help "$@"

seconds="" live=false sink="" count=4 truth=false measure=false all=false
while [ $# -gt 0 ]; do
  case $1 in
    --cameras) count=${2:?--cameras needs 4, 5 or 8}; shift ;;
    --live) live=true ;;
    --truth) truth=true ;;
    --measure) measure=true ;;
    --all) all=true ;;
    --sink) sink=${2:?--sink needs an element}; shift ;;
    --seconds) seconds=${2:?--seconds needs a number}; shift ;;
    *) fail "unknown argument '$1'; usage: pipelines/demo.sh [--cameras 4|5|8] [--live [--sink ELEMENT]] [--seconds N] [--truth] [--measure] [--all]" ;;
  esac
  shift
done
[[ ${seconds:-1} =~ ^[0-9]+$ ]] && [ "${seconds:-1}" -gt 0 ] || fail "--seconds needs a whole number above 0"
folder=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
case $count in
  4) rig_file="" ;;
  5) rig_file=$folder/rigs/five.json ;;
  8) rig_file=$folder/rigs/eight.json ;;
  *) fail "--cameras is $count; there are rigs of 4, 5 and 8" ;;
esac
[ -z "$sink" ] || $live || fail "--sink says where --live shows its pictures; add --live"

# All that is built needs more libraries than the film; the first picture comes before it is built.
if $all; then
  polyhull_install "${polyhull_packages_build[@]}" "${polyhull_packages_run[@]}"
  [ ! -f "$polyhull_build/build.ninja" ] || polyhull_configure "$polyhull_build" -Dcalibration=enabled
else
  polyhull_install "${polyhull_packages_demo[@]}"
fi
$polyhull_installed || [ -e "$polyhull_build/plugins/libgstpolyhull.so" ] ||
  say "the first build takes about 8 minutes of one core: $((8 * 60 / $(nproc))) s on this machine's $(nproc)"
polyhull_build_targets plugins/libgstpolyhull.so tools/polyhull-run
polyhull_environment

rate=25
$live && rate=10
length=${seconds:+$((seconds * rate))}
frames=${length:-$((10 * rate))}
out=$polyhull_source/out
mkdir -p "$out"
cameras=()
for ((index = 0; index < count; ++index)); do cameras+=("cam$index"); done
rig=${rig_file:+rig=$rig_file}

# Keying, blur and contours of one camera, from the pad or element named before it.
silhouette_of() {
  echo "queue max-size-buffers=2 ! chromamatte name=key_$1 ! gaussblur name=blur_$1 sigma=1.5 !
    contourfind name=contours_$1 camera=$1 tolerance=0.7 min-area=100 ! hull."
}
beside="queue max-size-buffers=2 !"  # lets what follows work beside what comes before
chain="hullbuild name=hull $rig ! $beside hullrefine name=refine ! $beside hulltexture name=texture ! $beside tee name=meshes"
room="scenesrc name=room path=orbit orbit-start=30 orbit-speed=45 num-buffers=$frames !
  video/x-raw,width=1280,height=720,framerate=$rate/1 ! queue max-size-buffers=2 !
  composite.background"

synthetic_cameras() {
  local camera
  for camera in "${cameras[@]}"; do
    echo "rigtestsrc name=$camera camera=$camera $rig num-buffers=$1 noise=2 spill=0.3 unevenness=0.15
      shadow=0.3 is-live=$live ! video/x-raw,format=I420,framerate=$rate/1 ! $(silhouette_of "$camera")"
  done
}

if $live; then
  [ -n "$sink${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] ||
    fail "--live needs a display, and there is none; --sink \"fakesink sync=true\" runs it without"
  say "showing the live chain; close the window or press Ctrl-C to end"
  # shellcheck disable=SC2046,SC2086
  exec polyhull-run $(synthetic_cameras "${length:--1}") $chain ! composite.mesh_0 \
    scenesrc name=room is-live=true num-buffers="${length:--1}" ! \
    video/x-raw,width=640,height=360,framerate=$rate/1 ! composite.background \
    composite name=composite ! videoconvert ! queue max-size-buffers=2 ! ${sink:-autovideosink}
fi

say "making the film: $frames frames of $count 1024x768 cameras to 1280x720, about $((frames / 4)) s on two cores"
rm -f "$out"/demo-*.png
# Says when the first picture is there, long before the film has ended.
until [ -s "$out/demo-00.png" ]; do sleep 0.2; done && sleep 0.3 &&
  say "the first picture, $SECONDS s from the start: out/demo-00.png" &
watcher=$!
trap 'kill "$watcher" 2>/dev/null || true' EXIT
# RGBA for both branches, not the encoder's NV12: the pictures may be held against the truth below.
# shellcheck disable=SC2046,SC2086
polyhull-run --brief --count composite --json "$out/demo.json" $(synthetic_cameras "$frames") $chain \
  meshes. ! queue max-size-buffers=2 ! composite.mesh_0 \
  meshes. ! queue max-size-buffers=2 ! multifilesink async=false location="$out/demo.mesh" \
  $room composite name=composite ! tee name=pictures \
  pictures. ! queue max-size-buffers=2 ! videoconvert ! x264enc speed-preset=veryfast ! \
  mp4mux ! filesink async=false location="$out/demo.mp4" \
  pictures. ! queue max-size-buffers=2 ! videorate drop-only=true ! video/x-raw,framerate=1/1 ! \
  videoconvert ! pngenc ! multifilesink async=false location="$out/demo-%02d.png"

say "the film is made, $SECONDS s from the start: out/demo.mp4; building what draws the contact sheet"
polyhull_build_targets tools/polyhull-report
say "drawing the contact sheet, writing the hull"
sheet=()
for picture in "$out"/demo-0[0146].png; do
  [ -f "$picture" ] && sheet+=(--composite "$picture")
done
polyhull-report sheet "$out/demo.mesh" -o "$out/demo.png" "${sheet[@]}"
gst-launch-1.0 filesrc location="$out/demo.mesh" blocksize=1073741824 ! \
  application/x-polyhull-mesh ! hullexport location="$out/hull.glb"
polyhull-report coverage "$out/demo.mesh"

if $truth; then
  polyhull_build_targets tools/polyhull-truth
  say "holding two composites against the path-traced truth (same room, true figure)"
  for index in 0 1; do # before a camera, and between two
    picture=$(printf '%s/demo-%02d.png' "$out" "$index")
    [ -f "$picture" ] || continue
    # Picture N is N seconds into the stream; the viewport is where scenesrc's orbit has it then.
    read -r x z <<<"$(awk -v t="$index" 'BEGIN {
      a = (30 + 45 * t) * atan2(0, -1) / 180; printf "%.9f %.9f", 2.7 * sin(a), 2.7 * cos(a) }')"
    echo "at $index s:"
    polyhull-truth "$picture" --seconds "$index" --eye "$x" 1.5 "$z" -o "$out/demo-truth-$index.png"
  done
fi

if $measure; then
  say "measuring the whole chain from recorded files"
  "$(dirname "$0")/record.sh" ${rig_file:+--rig "$rig_file"} --cameras "${cameras[*]}" --seconds 2 "$out/recording" >"$out/recording.log" 2>&1 ||
    { cat "$out/recording.log" >&2; fail "the recording failed"; }
  recorded=""
  for camera in "${cameras[@]}"; do
    recorded+=" filesrc location=$out/recording/$camera.y4m blocksize=1179648 ! y4mdec ! $(silhouette_of "$camera")"
  done
  # The room stands still, so that its picture costs nothing after the first: what counts is the chain.
  # shellcheck disable=SC2086
  polyhull-run --count composite --json "$out/demo-recorded.json" $recorded $chain meshes. ! composite.mesh_0 \
    scenesrc name=room refinement=never num-buffers=50 ! video/x-raw,width=1280,height=720,framerate=25/1 ! \
    queue max-size-buffers=2 ! composite.background composite name=composite ! fakesink
fi
rm -rf "$out/recording" "$out/recording.log" "$out"/demo-[0-9][0-9].png
if $all; then polyhull_build_targets programs; fi

say "made, $SECONDS s from the start:"
(cd "$out" && ls -l demo* hull.glb)
