#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Runs a test program of the plain build on the libraries of a sanitized one, whose folder
# POLYHULL_SANITIZED names: meson test -C build-release --wrapper tests/sanitized.sh. So the program itself
# needs no second compilation. One that tests polyhull's static libraries has a twin in the sanitized build,
# which runs in its stead. Scripts run as they are. Unless all is asked for (tests/run.sh --long), these cases are
# left out: Embedded OpenGL, where the libraries do as on the desktop's but for what shaders are made of, and those
# of sanitized_long.txt, which take long here and only compare what other cases reach, too.
set -eu
program=$1
shift
sanitized=${POLYHULL_SANITIZED:?names no build folder with sanitizers}
[ "$program" != "${program#"$POLYHULL_BUILD"/}" ] || exec "$program" "$@"
case $program in
  *allocation*_test) echo "SKIPPED: the sanitizers' allocator takes the place of the one that counts"; exit 77 ;;
  */tests/elements/* | */tests/stress/*) export GST_PLUGIN_PATH=$sanitized/plugins GST_REGISTRY=$sanitized/gst-registry.bin ;;
esac
if [ -n "${POLYHULL_LONG:-}" ]; then
  # Whole stacks tell other libraries' leaks from ours, GLib's memory included. They take several times as long,
  # and lock up in Mesa's code generator, so those that draw look for no leaks or for ours alone.
  case $program:${ASAN_OPTIONS:-} in
    *detect_leaks=0*) ;;
    */tests/elements/* | */hullbuild_soak_test:* | */boards_test:*)
      export ASAN_OPTIONS=${ASAN_OPTIONS:-}:fast_unwind_on_malloc=0
      export LSAN_OPTIONS=print_suppressions=0:suppressions=$(dirname "$0")/lsan.supp ;;
  esac
else
  left_out=$(grep -hv '^#' "$(dirname "$0")"/{long,sanitized_long}.txt | paste -sd :)
  export GTEST_FILTER=${GTEST_FILTER:--*/Embedded:$left_out}
fi
twin=$sanitized/${program#"$POLYHULL_BUILD"/}
if [ -x "$twin" ]; then
  unset LD_LIBRARY_PATH
  exec "$twin" "$@"
fi
export LD_LIBRARY_PATH=$sanitized/lib
# The address sanitizer has to be the first library of the process; the sanitized ones bring the rest.
runtime=$(c++ -print-file-name=libasan.so)
exec env LD_PRELOAD="$runtime" "$program" "$@"
