#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs a test program of the plain build on the libraries of a sanitized one, whose folder
# POLYHULL_SANITIZED names: meson test -C build-release --wrapper tests/sanitized.sh. So the program itself
# needs no second compilation. One that runs GStreamer, whose start hangs so, or links one of polyhull's
# static libraries has a twin in the sanitized build, which runs in its stead. Scripts run as they are.
set -eu
program=$1
shift
sanitized=${POLYHULL_SANITIZED:?names no build folder with sanitizers}
[ "$program" != "${program#"$POLYHULL_BUILD"/}" ] || exec "$program" "$@"
case $program in
  */hull_allocations_test) echo "SKIPPED: the sanitizers' allocator does not tell how much it holds"; exit 77 ;;
  # Programs that these start are the plain build's, which cannot load sanitized elements.
  */tests/elements/* | */tests/stress/*) export GST_PLUGIN_PATH=$sanitized/plugins GST_REGISTRY=$sanitized/gst-registry.bin ;;
esac
twin=$sanitized/${program#"$POLYHULL_BUILD"/}
if [ -x "$twin" ]; then
  unset LD_LIBRARY_PATH
  exec "$twin" "$@"
fi
export LD_LIBRARY_PATH=$sanitized/lib
# The address sanitizer has to be the first library of the process; the sanitized ones bring the rest.
runtime=$(c++ -print-file-name=libasan.so)
exec env LD_PRELOAD="$runtime" "$program" "$@"
