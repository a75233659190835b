#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Tests everything, from a bare Debian 12 on: installs what is missing, builds, runs all tests, then the
# library and element tests again with libraries and elements that the address and undefined-behaviour
# sanitizers watch, assertions on (those of calibration with --long alone). Ends with a line "N passed, N failed,
# N skipped"; what was skipped inside programs that passed is told before. Left out are hull_cgal and refine_crossings, references by CGAL
# that take minutes to compile (configure build-release with -Dbenchmarks=true), and what skips without
# Blender (outside-renderer, a case of polyhull-take) or COLMAP (a case of colmap), which are not installed.
#   tests/run.sh [--quick | --long]
#     --quick   only the tests nearest to what the working tree changes, for at most two minutes
#     --long    with all cases: soaks, all random scenes, all random settings, network minutes
set -euo pipefail
source "$(dirname "$0")/../pipelines/prepare.sh"
polyhull_help "$@"

quick=false long=false
for argument in "$@"; do
  case $argument in
    --quick) quick=true ;;
    --long) long=true; export POLYHULL_LONG=1 POLYHULL_STRESS=${POLYHULL_STRESS:-100} ;;
    *) fail "unknown argument '$argument'; usage: tests/run.sh [--quick | --long]" ;;
  esac
done

polyhull_install "${polyhull_packages_build[@]}" "${polyhull_packages_run[@]}" \
  "${polyhull_packages_test[@]}"
polyhull_configure "$polyhull_build" -Dbuildtype=release -Dtests=true -Dcalibration=enabled

logs=$polyhull_build/meson-logs
good=true
second=()  # tests that had a second try
# run_tests LOG-NAME MESON-TEST-ARGUMENT...: one more at once than there are processors, as some of them wait.
run_tests() {
  meson test -C "$polyhull_build" --num-processes $(($(nproc) + 1)) --print-errorlogs --logbase "$@" || good=false
}

# name_cases LOG-NAME MESON-TEST-ARGUMENT...: one process for all cases (CK_FORK=no, below) does not tell which of them
# crashed or hung: the element tests of the log that failed run once more with a process for each case, for what this
# prints alone.
name_cases() {
  local name=$1 test
  shift
  for test in $(cat "$logs/$name"*.json |
    sed -n '/"result": "\(OK\|SKIP\|EXPECTEDFAIL\)"/!s|^{"name": "[^"]* / \(element-[^"]*\)".*|\1|p'); do
    say "failed: $test; its cases once more, each in a process of its own, to name those that fail"
    CK_FORK=yes meson test -C "$polyhull_build" --no-rebuild --print-errorlogs --logbase "cases-$name-$test" "$@" "$test" ||
      true
  done
}

# run_suite LOG-NAME PATTERN MESON-TEST-ARGUMENT...: those of real time, whose names have PATTERN, come last and two at a
# time: they need a machine that is not busy, and do little. One that fails has a second try, alone, but for what the
# sanitizers find. Under these, those whose sources then ask for no times run beside all others.
run_suite() {
  local name=$1 pattern=$2 timed beside="" failed test
  shift 2
  rm -f "$logs/$name"* "$logs/cases-$name"*
  timed=$(meson test -C "$polyhull_build" --no-rebuild --list --suite real-time | sed -n "s|.* / \\(.*$pattern.*\\)|\\1|p")
  [ -n "$timed" ] || fail "no test of real time is called '$pattern'"
  run_timed() { meson test -C "$polyhull_build" --no-rebuild --print-errorlogs --logbase "$name-$1" "${@:2}" "$1" >&2; }
  # run_all AT-ONCE NAMES MESON-TEST-ARGUMENT...: prints the names of those that fail.
  run_all() { xargs -r -P "$1" -I{} bash -c 'run_timed "$@" || echo "$1"' run_timed {} "${@:3}" <<<"$2"; }
  export -f run_timed
  export name polyhull_build
  if [ "$name" = sanitized ]; then
    beside=$(cd "$polyhull_source/tests/elements" && grep -l 'in_time = !sanitized()' ./*_test.cpp |
      sed 's|./\(.*\)_test.cpp|element-\1|' | grep -xF "$timed" || true)
    timed=$(grep -vxF "$beside" <<<"$timed" || true)
  fi
  exec {beside_failed}< <(run_all 1 "$beside" "$@")
  run_tests "$name" --no-suite real-time "$@"
  failed=$(cat <&"$beside_failed"; run_all 2 "$timed" "$@")
  for test in $failed; do
    if [ "$name" = sanitized ]; then
      good=false
      continue
    fi
    say "once more, alone: $test"
    mv "$logs/$name-$test.txt" "$logs/first-$test.txt" || true
    second+=("$test")
    run_timed "$test" "$@" || good=false
  done
  name_cases "$name" "$@"
}

# finish LOG...: the summary, and the status.
finish() {
  say "$((SECONDS / 60)) min $((SECONDS % 60)) s; logs: $logs"
  [ ${#second[@]} -eq 0 ] || say "had a second try, alone (first-NAME.txt is the first): ${second[*]}"
  $good || echo "meson test has failed: see above"  # with tests that failed, or before it ran them
  "$polyhull_source/tests/summary.py" "$@" && $good
}

# All cases of an element test in one process: a process of its own for each takes most of a short case's time, and
# under the sanitizers nearly all of it. `meson test NAME` gives each one, and so tells which has crashed (name_cases).
export CK_FORK=no
$long || export GTEST_FILTER=-$(grep -v '^#' "$polyhull_source/tests/long.txt" | paste -sd :)

if $quick; then
  mapfile -t nearest < <("$polyhull_source/tests/nearest.py" "$polyhull_build")
  [ ${#nearest[@]} -gt 0 ] || fail "no test is near to what the working tree changes"
  say "building what these link and running them: ${nearest[*]}"
  rm -f "$logs"/quick*
  run_tests quick "${nearest[@]}"
  name_cases quick
  finish "$logs"/quick*.json
  exit
fi

say "building $polyhull_build (nothing to do where nothing changed)"
ninja -C "$polyhull_build"
say "running the tests, $SECONDS s from the start"
run_suite plain ""
unset GTEST_FILTER  # sanitized.sh has its own

sanitized=$polyhull_source/build-sanitize
polyhull_configure "$sanitized" -Dtests=true -Dsanitize=true -Dcalibration=enabled -Dbuildtype=plain \
  -Doptimization=1 -Db_ndebug=false -Db_lundef=false
say "building the libraries and elements with the sanitizers"
if ninja -C "$sanitized" sanitized ${POLYHULL_LONG:+sanitized-long}; then
  say "running the library and element tests on them, $SECONDS s from the start"
  export POLYHULL_SANITIZED=$sanitized
  # Calibration is a static library: without the twins (sanitized-long) its code would run as the plain build has it.
  calibration=(--no-suite calibration)
  $long && calibration=()
  run_suite sanitized element- --suite lib --suite elements --suite stress "${calibration[@]}" --timeout-multiplier 4 \
    --wrapper "$polyhull_source/tests/sanitized.sh"
else
  good=false
  rm -f "$logs"/sanitized*
fi
mapfile -t results < <(compgen -G "$logs/plain*.json"; compgen -G "$logs/sanitized*.json")
finish "${results[@]}"
