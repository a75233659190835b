#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Packs the tests of OpenGL and the benchmark of composites, with the libraries that they need, into a
# folder that runs on any x86-64 Linux with a vendor's EGL driver: nothing is installed there.
#   tests/gpu.sh BUILD FOLDER
# BUILD: a build folder configured with -Dbuildtype=release -Dtests=true -Dbenchmarks=true. There:
#   FOLDER/run.sh [OUTPUT]    prints the device, each test's result and the table of composites, in a few
#                             minutes; logs and tables go to OUTPUT
# Needs GStreamer here, for the meshes that are drawn.
set -euo pipefail
source "$(dirname "$0")/../pipelines/prepare.sh"
polyhull_help "$@"
[ $# -eq 2 ] || fail "usage: tests/gpu.sh BUILD FOLDER"
[ -f "$1/build.ninja" ] || fail "'$1' is no build folder"
build=$(realpath "$1") folder=$2 source=$polyhull_source

# Those that make a context of OpenGL: of each its program and, where this has others' cases, too, its name.
names=$(cd "$source/tests" && grep -lE '"(backend|gl_context|shot)\.h"' -r lib stress --include='*_test.cpp' |
  sed 's#.*/##; s#_test\.cpp$##')
mapfile -t tests < <(meson introspect --tests "$build" | NAMES=$names python3 -c '
import json, os, sys
for test in json.load(sys.stdin):
    program, *words = test["cmd"]
    if test["name"] in os.environ["NAMES"].split():
        print("tests/" + program.rsplit("/tests/", 1)[1], *words)' | sort)
programs=$(printf '%s\n' "${tests[@]}" | sed 's/ .*//' | sort -u)
ninja -C "$build" plugins/libgstpolyhull.so tests/benchmarks/picture_benchmark $programs

packed=$(mktemp -d)
trap 'rm -rf "$packed"' EXIT
mkdir "$packed"/{tests,lib,glvnd,meshes}
for program in $programs; do cp "$build/$program" "$packed/tests/"; done
printf '%s\n' "${tests[@]##*/}" > "$packed/tests.txt"
cp "$build/tests/benchmarks/picture_benchmark" "$packed/"

cameras=()
for camera in cam0 cam1 cam2 cam3; do
  cameras+=(rigtestsrc "camera=$camera" num-buffers=4 ! video/x-raw,format=I420,framerate=1/1 ! queue
            ! silhouette "camera=$camera" ! hull.)
done
GST_PLUGIN_PATH=$build/plugins GST_REGISTRY=$packed/registry.bin \
  gst-launch-1.0 -q hullbuild name=hull ! hulltexture ! multifilesink "location=$packed/meshes/%02d.bin" "${cameras[@]}"
rm -f "$packed/registry.bin"

# The C library is the machine's own; the way to its driver, too, where it has one.
LD_LIBRARY_PATH=$build/lib ldd "$packed"/picture_benchmark "$packed"/tests/* | sed -n 's#.*=> \(/.*\) (0x.*#\1#p' | sort -u |
  grep -vE '/(libc|libm|libdl|libpthread|librt|libresolv)\.so' | xargs -d '\n' cp -Lt "$packed/lib"
for library in libEGL.so.1 libGLESv2.so.2 libOpenGL.so.0 libGLdispatch.so.0; do
  path=$(ldconfig -p | awk -v name="$library" '$1 == name { print $NF; exit }')
  [ -z "$path" ] || cp -L "$path" "$packed/glvnd/"
done
strip --strip-unneeded "$packed"/picture_benchmark "$packed"/tests/* "$packed"/lib/* "$packed"/glvnd/*

mkdir -p "$folder"
tar -C "$packed" -czf "$folder/packed.tar.gz" .
cp "$source/tests/gpu/run.sh" "$folder/run.sh"
du -sh "$folder"
