#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Tests everything, from a bare Debian 12 on: installs what is missing, builds, runs all tests, then the
# library and element tests again with libraries and elements that the address and undefined-behaviour
# sanitizers watch, assertions on. Ends with a line "N passed, N failed, N skipped"; what was skipped
# inside programs that passed is told before.
#   tests/run.sh [--quick | --long]
#     --quick   only the tests nearest to what the working tree changes, for at most two minutes
#     --long    with all cases: soaks, all random scenes, all random settings, network minutes
set -euo pipefail
source "$(dirname "$0")/../pipelines/prepare.sh"
polyhull_help "$@"

quick=false
for argument in "$@"; do
  case $argument in
    --quick) quick=true ;;
    --long) export POLYHULL_LONG=1 POLYHULL_STRESS=${POLYHULL_STRESS:-100} ;;
    *) fail "unknown argument '$argument'; usage: tests/run.sh [--quick | --long]" ;;
  esac
done

polyhull_install "${polyhull_packages_build[@]}" "${polyhull_packages_run[@]}" \
  "${polyhull_packages_test[@]}"
polyhull_configure "$polyhull_build" -Dbuildtype=release -Dtests=true -Dcalibration=enabled

passed=0 failed=0 skipped=0 broken= missing= times=()
# run_suite LOG-NAME MESON-TEST-ARGUMENT...: adds meson's summary to the totals.
run_suite() {
  local name=$1 log
  shift
  log=$(mktemp)
  local logs=$polyhull_build/meson-logs/$name  # meson adds a wrapper's name
  rm -f "$logs"*
  meson test -C "$polyhull_build" --print-errorlogs --logbase "$name" "$@" 2>&1 | tee "$log" || true
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
  broken+=$(grep -hE '^[^ ]+:[0-9]+:[EF]:' "$logs"*.txt | sed 's/^/\n  /' || true)
  # What GoogleTest and the other programs left out, with the reason where it stands in the line.
  missing+=$(grep -hE '^\[  SKIPPED \] .* \(|^SKIPPED: ' "$logs"*.txt | sed 's/^/\n  /' || true)
  rm -f "$log"
  times+=("$logs"*.json)
}

# finish: the summary, and the status.
finish() {
  "$polyhull_source/tests/times.py" 20 "${times[@]}" || true
  [ -z "$missing" ] || printf 'What was skipped inside programs:\n%b\n' "$missing"
  [ -z "$broken" ] || printf 'What failed:\n%b\n' "$broken"
  say "$((SECONDS / 60)) min $((SECONDS % 60)) s; logs: $polyhull_build/meson-logs"
  echo "$passed passed, $failed failed, $skipped skipped"
  [ "$failed" -eq 0 ]
}

if $quick; then
  mapfile -t nearest < <("$polyhull_source/tests/nearest.py" "$polyhull_build")
  [ ${#nearest[@]} -gt 0 ] || fail "no test is near to what the working tree changes"
  say "building what these link and running them: ${nearest[*]}"
  run_suite quick "${nearest[@]}"
  finish
  exit
fi

say "building $polyhull_build (nothing to do where nothing changed)"
ninja -C "$polyhull_build"
say "running the tests, $SECONDS s from the start"
run_suite testlog

sanitized=$polyhull_source/build-sanitize
polyhull_configure "$sanitized" -Dtests=true -Dsanitize=true -Dcalibration=enabled -Dbuildtype=plain \
  -Doptimization=1 -Db_ndebug=false -Db_lundef=false
say "building the libraries and elements with the sanitizers"
ninja -C "$sanitized" sanitized ${POLYHULL_LONG:+sanitized-long}
say "running the library and element tests on them, $SECONDS s from the start"
export POLYHULL_SANITIZED=$sanitized
run_suite sanitized --suite lib --suite elements --suite stress --timeout-multiplier 4 \
  --wrapper "$polyhull_source/tests/sanitized.sh"
finish
