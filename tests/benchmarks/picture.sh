#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# All figures of docs/benchmarks-picture.md: records meshes of the demo, measures what composites and
# scenesrc's views cost and how far they are from the truth, and draws docs/pictures/picture-*.png.
#   tests/benchmarks/picture.sh BUILD [PREFIX...]
# BUILD: a build folder configured with -Dbenchmarks=true -Dbuildtype=release; PREFIX: a command that
# runs each piece, e.g. one that waits for a quiet machine.
set -euo pipefail
build=$(realpath "$1")
shift
source=$(realpath "$(dirname "$0")/../..")
tables=$build/benchmarks
programs=$build/tests/benchmarks
mkdir -p "$tables/meshes"
export GST_PLUGIN_PATH=$build/plugins GST_REGISTRY=$build/benchmarks/registry.bin GST_REGISTRY_FORK=no
export GST_GL_PLATFORM=${GST_GL_PLATFORM-egl} GST_GL_WINDOW=${GST_GL_WINDOW-egl-device}

cameras=()
for camera in cam0 cam1 cam2 cam3; do
  cameras+=(rigtestsrc "camera=$camera" num-buffers=10 ! video/x-raw,format=I420,framerate=1/1 ! queue
            ! silhouette "camera=$camera" ! hull.)
done
gst-launch-1.0 -q hullbuild name=hull ! hulltexture ! multifilesink "location=$tables/meshes/%02d.bin" \
  "${cameras[@]}"
for size in 1280x720 1920x1080 3840x2160; do
  "$@" "$programs/picture_benchmark" --size $size --output "$tables" "$tables"/meshes/*.bin
  mv "$tables/picture.csv" "$tables/picture-$size.csv"
done
"$@" "$programs/picture_error_benchmark" --output "$tables"
"$@" "$programs/lens_benchmark" --output "$tables"
"$@" "$programs/edge_benchmark" "$tables"
"$@" "$programs/background_benchmark" --truth 48 --tables "$tables"
gnuplot -e "tables='$tables'; pictures='$source/docs/pictures'" "$source/tests/benchmarks/picture_plots.gp"
