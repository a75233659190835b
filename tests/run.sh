#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Tests everything, from a bare Debian 12 on: installs what is missing, builds, runs all tests, then
# builds again with the address and undefined-behaviour sanitizers and runs the library and element
# tests there. Ends with a line "N passed, N failed, N skipped"; what was skipped inside programs that
# passed is told before.
#   tests/run.sh [--quick]     --quick leaves the sanitizers out
set -euo pipefail
source "$(dirname "$0")/../pipelines/prepare.sh"
polyhull_help "$@"
polyhull_build=${POLYHULL_BUILD_DIR:-$polyhull_source/build}

quick=false
for argument in "$@"; do
  [ "$argument" = --quick ] || fail "unknown argument '$argument'; usage: tests/run.sh [--quick]"
  quick=true
done

polyhull_install "${polyhull_packages_build[@]}" "${polyhull_packages_run[@]}" \
  "${polyhull_packages_test[@]}"
# A new build folder has lines for back traces and no more: whole debug information takes a quarter of
# the time to build. One that is there keeps what it has.
debug=()
[ -f "$polyhull_build/build.ninja" ] || debug=(-Dcpp_args=-g1)
polyhull_compile "$polyhull_build" -Dtests=true -Dbuildtype=debugoptimized "${debug[@]}"

passed=0 failed=0 skipped=0 broken= missing=
# run_suite BUILD-DIRECTORY MESON-TEST-ARGUMENT...: adds meson's summary to the totals.
run_suite() {
  local directory=$1 log
  shift
  log=$(mktemp)
  rm -f "$directory/meson-logs/testlog.txt"
  meson test -C "$directory" --print-errorlogs "$@" 2>&1 | tee "$log" || true
  count() { sed -n "s/^$1: *\([0-9]*\).*/\1/p" "$log" | tail -n 1; }
  local ok fail timeout skip
  ok=$(count Ok) fail=$(count Fail) timeout=$(count Timeout) skip=$(count Skipped)
  if [ -z "$ok" ]; then
    echo "meson test gave no summary"
    fail=1
  fi
  passed=$((passed + ${ok:-0}))
  failed=$((failed + ${fail:-0} + ${timeout:-0}))
  skipped=$((skipped + ${skip:-0}))
  broken+=$(grep -E '^ *[0-9]+/[0-9]+ .* (FAIL|ERROR|TIMEOUT) ' "$log" || true)
  # gst-check's lines that say which check failed, and where.
  broken+=$(grep -hE '^[^ ]+:[0-9]+:[EF]:' "$directory/meson-logs/testlog.txt" | sed 's/^/\n  /' || true)
  # What GoogleTest and the other programs left out, with the reason where it stands in the line.
  missing+=$(grep -hE '^\[  SKIPPED \] .* \(|^SKIPPED: ' "$directory/meson-logs/testlog.txt" | sed 's/^/\n  /' || true)
  rm -f "$log"
}

say "running the tests"
run_suite "$polyhull_build"

if ! $quick; then
  polyhull_configure "$polyhull_build-sanitize" -Dtests=true -Dsanitize=true -Dbuildtype=plain -Doptimization=1 \
    -Db_lundef=false
  say "building the library and element tests with the sanitizers, and running them"
  run_suite "$polyhull_build-sanitize" --suite lib --suite elements --suite stress \
    --timeout-multiplier 4
fi

[ -z "$missing" ] || printf 'What was skipped inside programs:\n%b\n' "$missing"
[ -z "$broken" ] || printf 'What failed:\n%b\n' "$broken"
say "logs: $polyhull_build/meson-logs/testlog.txt"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
