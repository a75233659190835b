# SPDX-License-Identifier: LGPL-2.1-or-later
# Shared by pipelines/cameras-*.sh (sourced, not run): options, and how the line is shown or run. The script
# gives option() (1: took no value, 2: unknown), line and cameras_present().

rig="" cameras=() rate=25 sink=fakesink dry_run=false

# cameras_number OPTION VALUE
cameras_number() {
  [[ $2 =~ ^[0-9]+(\.[0-9]+)?$ ]] || fail "$1 is '$2'; expected a number"
}

# cameras_options ARGUMENT...
cameras_options() {
  local list="" taken name seen=" "
  while [ $# -gt 0 ]; do
    case $1 in
      --dry-run) dry_run=true; shift; continue ;;
      --ptp) ;;
      --*) [ $# -gt 1 ] || fail "$1 needs a value, or is an unknown argument; --help says what there is" ;;
      *) fail "unknown argument '$1'; --help says what there is" ;;
    esac
    case $1 in
      --rig) rig=$2; shift 2 ;;
      --cameras) list=$2; shift 2 ;;
      --rate) rate=$2; shift 2 ;;
      --sink) sink=$2; shift 2 ;;
      *)
        taken=0
        option "$@" || taken=$?
        [ "$taken" -ne 2 ] || fail "unknown argument '$1'; --help says what there is"
        shift $((2 - taken))
        ;;
    esac
  done
  [ -n "$rig" ] || fail "--rig FILE says where the cameras stand; --help says what else there is"
  [ -f "$rig" ] || fail "the rig file '$rig' does not exist"
  [[ $rate =~ ^[0-9]+$ ]] && [ "$rate" -gt 0 ] || fail "--rate is '$rate'; expected a whole number above 0"
  read -ra cameras <<<"$list"
  [ ${#cameras[@]} -ge 2 ] && [ ${#cameras[@]} -le 16 ] ||
    fail "--cameras names ${#cameras[@]} cameras; expected 2 to 16 as NAME=ADDRESS, separated by spaces"
  for name in "${cameras[@]}"; do
    [[ $name == ?*=?* ]] || fail "--cameras has '$name'; expected NAME=ADDRESS"
    [[ $seen != *" ${name%%=*} "* ]] || fail "--cameras names '${name%%=*}' twice"
    grep -qF "\"${name%%=*}\"" "$rig" || fail "the rig file '$rig' has no camera '${name%%=*}'"
    seen+="${name%%=*} "
  done
}

# cameras_run: prints the line, or runs it.
cameras_run() {
  if $dry_run; then
    printf 'gst-launch-1.0'
    printf ' %q' "${line[@]}"
    printf '\n'
    return
  fi
  cameras_present
  polyhull_programs
  polyhull_environment
  exec gst-launch-1.0 "${line[@]}"
}
