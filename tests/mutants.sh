#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Do the tests notice faults? Puts the faults of tests/mutants.txt into the code, one at a time,
# builds and runs the tests that are nearest to each, and says which faults no test noticed. Works in
# a git worktree of its own beside the checkout (<checkout>-mutants), which stays for the next run;
# it holds what git knows of the checkout, changed files included.
#   tests/mutants.sh [--list] [--check] [NUMBER | NUMBER-NUMBER | NAME]...
# NAME may be the beginning of a name. Without any, all faults.
#   --list    only prints the faults
#   --check   only looks whether each fault's line is there once, and its tests in the build folder if there is one
# Ends with a line "N faults: N killed, N survived, N not judged"; fails where one survived or could
# not be judged.
set -euo pipefail
source "$(dirname "$0")/../pipelines/prepare.sh"
polyhull_help "$@"

list=$polyhull_source/tests/mutants.txt
mode=run
wanted=()
for argument in "$@"; do
  case $argument in
    --list) mode=list ;;
    --check) mode=check ;;
    -*) fail "unknown argument '$argument'; see --help" ;;
    *) wanted+=("$argument") ;;
  esac
done

# The list's blocks; see there.
names=() files=() lines=() replacements=() tests=()
while IFS= read -r row || [ -n "$row" ]; do
  value=${row#*: }
  case $row in
    '' | '#'*) ;;
    'name: '*) names+=("$value") ;;
    'file: '*) files+=("$value") ;;
    'line: '*) lines+=("$value") ;;
    'with: '*) replacements+=("$value") ;;
    'with:') replacements+=('') ;;
    'test: '*) tests+=("$value") ;;
    *) fail "$list: what is '$row'?" ;;
  esac
done < "$list"
count=${#names[@]}
[ "$count" -gt 0 ] && [ "${#files[@]}/${#lines[@]}/${#replacements[@]}/${#tests[@]}" = "$count/$count/$count/$count" ] ||
  fail "$list: each fault needs name, file, line, with and test once"

# chosen NUMBER: whether the arguments ask for this fault.
chosen() {
  [ "${#wanted[@]}" -gt 0 ] || return 0
  local want
  for want in "${wanted[@]}"; do
    case $want in
      *[!0-9-]* | '' | -*) [[ ${names[$1 - 1]} != "$want"* ]] || return 0 ;;
      *-*) [ "$1" -lt "${want%%-*}" ] || [ "$1" -gt "${want##*-}" ] || return 0 ;;
      *) [ "$1" -ne "$want" ] || return 0 ;;
    esac
  done
  return 1
}

picked=()
for ((i = 1; i <= count; ++i)); do
  if chosen "$i"; then picked+=("$i"); fi
done
[ "${#picked[@]}" -gt 0 ] || fail "no fault is called ${wanted[*]}; see --list"

# place FOLDER NUMBER: prints the number of the fault's line in its file under FOLDER.
place() {
  local found
  [ -f "$1/${files[$2 - 1]}" ] || fail "fault ${names[$2 - 1]}: there is no file ${files[$2 - 1]}"
  # Whole lines but for their indentation.
  found=$(line=${lines[$2 - 1]} awk '{ text = $0; sub(/^[ \t]+/, "", text) } text == ENVIRON["line"] { print NR }' \
    "$1/${files[$2 - 1]}")
  case $found in
    '') fail "fault ${names[$2 - 1]}: ${files[$2 - 1]} no longer has its line: ${lines[$2 - 1]}" ;;
    *$'\n'*) fail "fault ${names[$2 - 1]}: ${files[$2 - 1]} has its line ${found//$'\n'/, } more than once: ${lines[$2 - 1]}" ;;
  esac
  echo "$found"
}

if [ "$mode" = list ]; then
  for i in "${picked[@]}"; do
    printf '%3d  %-36s %s (%s)\n' "$i" "${names[i - 1]}" "${files[i - 1]}" "${tests[i - 1]}"
  done
  exit
fi
for i in "${picked[@]}"; do place "$polyhull_source" "$i" > /dev/null; done
mapfile -t all < <(for i in "${picked[@]}"; do printf '%s\n' ${tests[i - 1]}; done | sort -u)

# check_names BUILD: whether each of the tests is one of this build folder.
check_names() {
  local known name
  known=$(meson test -C "$1" --no-rebuild --list 2> /dev/null | sed 's|.* / ||')
  for name in "${all[@]}"; do grep -qx -e "$name" <<< "$known" || fail "there is no test '$name'"; done
}

if [ "$mode" = check ]; then
  [ ! -f "$polyhull_build/build.ninja" ] || check_names "$polyhull_build"
  echo "${#picked[@]} faults, each line found once"
  exit
fi

copy=$polyhull_source-mutants
build=$copy/build
commit=$(git -C "$polyhull_source" stash create)
commit=${commit:-$(git -C "$polyhull_source" rev-parse HEAD)}
if [ -e "$copy" ]; then
  git -C "$copy" checkout --quiet --force --detach "$commit"
else
  git -C "$polyhull_source" worktree add --quiet --detach "$copy" "$commit"
fi
[ -f "$build/build.ninja" ] ||
  polyhull_source=$copy polyhull_configure "$build" -Dbuildtype=release -Dtests=true -Dcalibration=enabled
trap 'git -C "$copy" checkout --quiet -- .' EXIT

# Without the long cases first, as tests/run.sh runs them. One case that fails is enough.
short=-$(grep -v '^#' "$polyhull_source/tests/long.txt" | paste -sd :)
export GTEST_FILTER=$short GTEST_FAIL_FAST=1

# run_tests TEST...: 0 where all pass, 125 where something does not build. Builds what these need.
run_tests() { CK_FORK=no meson test -C "$build" "$@" > "$build/mutant.log" 2>&1 < /dev/null; }

# Without a fault they must pass, or they would notice everything.
say "building, and running the tests without a fault"
grep -q "\"source\": \"$copy\"" "$build/meson-info/meson-info.json" || fail "$build is not of $copy; remove it"
check_names "$build"
run_tests "${all[@]}" || fail "the tests fail without a fault already; see $build/mutant.log"

killed=0 survived=() unjudged=()
for i in "${picked[@]}"; do
  file=$copy/${files[i - 1]}
  number=$(place "$copy" "$i")
  with=${replacements[i - 1]} number=$number awk 'NR == ENVIRON["number"] {
    match($0, /^[ \t]*/); print substr($0, 1, RLENGTH) ENVIRON["with"]; next } { print }' "$file" > "$file.mutant"
  cat "$file.mutant" > "$file"
  rm "$file.mutant"
  start=$SECONDS
  code=0
  # One test after the other, the nearest first, the long cases last: one that notices is enough.
  for GTEST_FILTER in "$short" '*'; do
    for test in ${tests[i - 1]}; do
      run_tests "$test" || code=$?
      [ "$code" -eq 0 ] || break 2
    done
  done
  case $code in
    0) verdict=SURVIVED survived+=("${names[i - 1]}") ;;
    125) verdict='NOT JUDGED: it does not build' unjudged+=("${names[i - 1]}") ;;
    *) verdict="killed by $test" killed=$((killed + 1)); [ "$GTEST_FILTER" = "$short" ] || verdict+=' --long' ;;
  esac
  GTEST_FILTER=$short
  printf '%3d  %-36s %s (%d s)\n' "$i" "${names[i - 1]}" "$verdict" $((SECONDS - start))
  git -C "$copy" checkout --quiet -- "${files[i - 1]}"
done

[ "${#survived[@]}" -eq 0 ] || printf 'Survived: %s\n' "${survived[*]}"
echo "${#picked[@]} faults: $killed killed, ${#survived[@]} survived, ${#unjudged[@]} not judged"
[ "$killed" -eq "${#picked[@]}" ]
