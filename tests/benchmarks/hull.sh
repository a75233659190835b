#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# All figures of docs/benchmarks-hull.md: runs the hull's benchmarks in pieces of less than 90 s and
# draws docs/pictures/hull-*.png.
#   tests/benchmarks/hull.sh BUILD [PREFIX...]
# BUILD: a build folder configured with -Dbenchmarks=true -Dbuildtype=release; PREFIX: a command that
# runs each piece, e.g. one that waits for a quiet machine. POLYHULL_DATA: the folder that holds
# hull_scenes/ and meshes/ (default: ../shared/data beside the checkout).
set -euo pipefail
build=$(realpath "$1")
shift
source=$(realpath "$(dirname "$0")/../..")
export POLYHULL_DATA=${POLYHULL_DATA:-$source/../shared/data}
tables=$build/benchmarks
programs=$build/tests/benchmarks
mkdir -p "$tables"
"$@" "$programs/hull_benchmark" --output "$tables" --parts growth,threads,steady --seconds 0.5
# CGAL takes minutes for the large ones: it runs up to N16 n200, half a minute.
append=
for scenes in figure_N4,figure_N8,figure_N16 figure_N32,knot,ring dup,far,huge,tiny; do
  "$@" "$programs/hull_benchmark" --output "$tables" --parts peers --only $scenes $append \
    --seconds 0.4 --points 200000
  append=--append
done
"$@" "$programs/hull_error_benchmark" --output "$tables"
"$@" "$programs/hull_sliver_benchmark" --output "$tables" --points 50000 --crossings 60000
gnuplot -e "tables='$tables'; pictures='$source/docs/pictures'" "$source/tests/benchmarks/hull_plots.gp"
