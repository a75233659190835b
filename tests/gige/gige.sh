#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Four GigE Vision cameras in software, each in a network namespace of its own at the end of a cable of
# its own, through aravissrc into hullbuild: started apart, unplugged, plugged in again.
#   tests/gige/gige.sh FOLDER [--minutes N]
# FOLDER holds the programs fake_camera and line (tests/gige of the build folder). --minutes N: a run of
# that length, cameras started 3 s apart, one unplugged each minute; by default 25 s, cameras a second
# apart, one unplugged once. Needs root, iproute2 and GStreamer's aravissrc; ends with 77 where one is
# missing. Nothing outside the namespaces is touched.
set -uo pipefail
skip() { echo "skipped: $*"; exit 77; }

case ${1:-} in
  -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;;
esac
folder=${1:?"usage: tests/gige/gige.sh FOLDER [--minutes N]"}
shift
[ -d "$folder" ] || { echo "error: there is no folder '$folder'" >&2; exit 1; }
folder=$(cd "$folder" && pwd)
[ -x "$folder/fake_camera" ] || skip "there is no fake_camera in $folder: build with Debian's libaravis-dev and libusb-1.0-0-dev"
[ "$(id -u)" -eq 0 ] || skip "network namespaces need root"
command -v ip >/dev/null || skip "there is no ip (Debian's iproute2)"
gst-inspect-1.0 aravissrc >/dev/null 2>&1 || skip "there is no aravissrc (Debian's libaravis-0.8-0)"

line=polyhull-$$-line
cameras=(0 1 2 3)
late=3000 # us that the last camera exposes after the others
programs=()
output=$(mktemp -d)
clean() {
  local program camera
  for program in "${programs[@]}"; do kill "$program" 2>/dev/null; done
  for program in "${programs[@]}"; do wait "$program" 2>/dev/null; done
  for camera in "${cameras[@]}"; do ip netns del "polyhull-$$-cam$camera" 2>/dev/null; done
  ip netns del "$line" 2>/dev/null
  rm -rf "$output"
}
trap clean EXIT
trap 'exit 130' INT TERM

ip netns add "$line" 2>"$output/error" || skip "no network namespace can be made: $(cat "$output/error")"
arguments=()
for camera in "${cameras[@]}"; do
  network=polyhull-$$-cam$camera
  {
    ip netns add "$network" &&
      ip link add "port$camera" netns "$line" type veth peer name eth0 netns "$network" &&
      ip -n "$line" address add "10.77.$camera.1/24" dev "port$camera" &&
      ip -n "$network" address add "10.77.$camera.2/24" dev eth0 &&
      ip -n "$line" link set dev "port$camera" up &&
      ip -n "$network" link set dev eth0 up
  } 2>"$output/error" || skip "no veth pair can be made: $(cat "$output/error")"
  ip netns exec "$network" "$folder/fake_camera" --interface eth0 --camera "cam$camera" \
    --late $((camera == 3 ? late : 0)) >"$output/cam$camera" &
  programs+=($!)
  arguments+=(--camera "10.77.$camera.2" --network "$network")
done
for camera in "${cameras[@]}"; do
  for ((tenth = 0; tenth < 600; ++tenth)); do
    grep -q ready "$output/cam$camera" && break
    kill -0 "${programs[$camera]}" 2>/dev/null || { echo "FAILED cam$camera ended before it was ready"; exit 1; }
    sleep 0.1
  done
  # A real camera does not wait for a busy machine.
  chrt --all-tasks --fifo --pid 20 "${programs[$camera]}" 2>/dev/null ||
    renice -n -15 -p "${programs[$camera]}" >/dev/null 2>&1 || echo "cameras have no priority: they may expose late"
done
ip netns exec "$line" "$folder/line" "${arguments[@]}" --late "$late" "$@" &
programs+=($!)
wait "${programs[-1]}"
