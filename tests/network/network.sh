#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Four capture machines and a server, each in a network namespace, over links of 5 ms +- 2 that lose a
# packet in a thousand: pipelines/capture.sh and server.sh as they are, one link cut and mended.
#   tests/network/network.sh FOLDER [OPTION...]
# FOLDER holds the program receiver (tests/network of the build folder). By default 25 s and one cut.
#     --minutes N      so long, with a cut each half minute
#     --every SECONDS  between cuts
#     --cut SECONDS    so long are they; default 4
#     --shrink N       pictures of 1024 / N x 768 / N pixels; default 2
#     --strict         a camera must be back within a second, no set may be old and none awaited for a
#                      second, which a machine with other work besides may miss; without, five seconds
# Needs root, iproute2 and /dev/net/tun; ends with 77 where one is missing. Nothing outside the
# namespaces is touched.
set -uo pipefail
skip() { echo "skipped: $*"; exit 77; }
case ${1:-} in
  -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;;
esac
folder=${1:?"usage: tests/network/network.sh FOLDER [OPTION...]"}
shift
seconds=25 between=100000 cut=4 strict="" shrink=2
while [ $# -gt 0 ]; do
  case $1 in
    --minutes) seconds=$((60 * ${2:?"--minutes needs a number"})) between=30; shift 2 ;;
    --every) between=${2:?"--every needs a number"}; shift 2 ;;
    --shrink) shrink=${2:?"--shrink needs a number"}; shift 2 ;;
    --cut) cut=${2:?"--cut needs a number"}; shift 2 ;;
    --strict) strict=--strict; shift ;;
    *) echo "error: unknown argument '$1'" >&2; exit 1 ;;
  esac
done
tests=$(cd "$(dirname "$0")/.." && pwd)
[ -x "$folder/receiver" ] || { echo "error: there is no receiver in '$folder'" >&2; exit 1; }
[ "$(id -u)" -eq 0 ] || skip "network namespaces need root"
command -v ip >/dev/null || skip "there is no ip (Debian's iproute2)"
[ -c /dev/net/tun ] || skip "there is no /dev/net/tun"

output=$(mktemp -d)
server=polyhull-$$-server
programs=() links=()
clean() {
  local program camera
  for program in "${programs[@]}" "${links[@]}"; do kill "$program" 2>/dev/null; done
  wait 2>/dev/null
  for camera in 0 1 2 3; do ip netns del "polyhull-$$-cam$camera" 2>/dev/null; done
  ip netns del "$server" 2>/dev/null
  rm -rf "$output"
}
trap clean EXIT
trap 'exit 130' INT TERM

ip netns add "$server" 2>"$output/error" || skip "no network namespace can be made: $(cat "$output/error")"
cameras=()
for camera in 0 1 2 3; do
  machine=polyhull-$$-cam$camera
  ip netns add "$machine" || skip "no network namespace can be made"
  /usr/bin/python3 "$tests/network/link.py" "$server" "cam$camera" "$machine" server 5 2 0.001 >"$output/link$camera" 2>&1 &
  links+=($!)
  for ((tenth = 0; tenth < 100; ++tenth)); do grep -q ready "$output/link$camera" && break; sleep 0.1; done
  grep -q ready "$output/link$camera" || skip "no link can be made: $(cat "$output/link$camera")"
  ip -n "$server" address add "10.78.$camera.1" peer "10.78.$camera.2" dev "cam$camera" &&
    ip -n "$server" link set dev "cam$camera" up &&
    ip -n "$machine" address add "10.78.$camera.2" peer "10.78.$camera.1" dev server &&
    ip -n "$machine" link set dev server up || exit 1
  cameras+=("cam$camera=10.78.$camera.2")
done

# What the scripts would run, with the programs of this build.
rig=$output/rig.json
# Cameras that skip instants because two cores cannot draw them have few instants in common, and what
# is measured is that: pictures are small enough to be drawn in time.
/usr/bin/python3 - "$tests/../pipelines/rigs/five.json" "$shrink" >"$rig" <<'END' || exit 1
import json, sys
rig, shrink = json.load(open(sys.argv[1])), int(sys.argv[2])
for camera in rig["cameras"]:
    camera["width"] //= shrink
    camera["height"] //= shrink
    for row in camera["K"][:2]:
        row[:] = [row[0] / shrink, row[1] / shrink, (row[2] + 0.5) / shrink - 0.5]
print(json.dumps(rig))
END
receiver=$("$tests/../pipelines/server.sh" --rig "$rig" --cameras "${cameras[*]}" --dry-run) || exit 1
for camera in 0 1 2 3; do
  capture=$("$tests/../pipelines/capture.sh" --camera "cam$camera" --server "10.78.$camera.1" --link 250 --dry-run \
    --source "rigtestsrc rig=$rig stamp=true camera=cam$camera is-live=true ! video/x-raw,framerate=25/1" \
    --silhouette "trigger-from=none") || exit 1
  # The clock comes with the server; a capture machine that finds none ends, and is started again.
  (
    trap 'kill $! 2>/dev/null; exit' TERM
    for ((attempt = 0; attempt < 5; ++attempt)); do
      eval "ip netns exec polyhull-$$-cam$camera $capture &"
      wait $!
    done
  ) >"$output/capture$camera" 2>&1 &
  programs+=($!)
done

# Tells the receiver what becomes of the links, while it becomes so.
cuts() {
  local second camera=2
  sleep 12
  for ((second = 12; second < seconds - 10; second += between)); do
    kill -USR1 "${links[$camera]}" && echo "cut cam$camera"
    sleep "$cut"
    kill -USR2 "${links[$camera]}" && echo "mend cam$camera"
    camera=$(((camera + 1) % 4))
    [ $((second + between)) -lt $((seconds - 10)) ] || break
    sleep "$(awk "BEGIN { print $between - $cut }")"
  done
}
words=${receiver#polyhull-run --clock-server }
cuts | eval "ip netns exec $server $folder/receiver $strict $seconds $words"
result=$?
if [ "$result" -ne 0 ]; then
  for camera in 0 1 2 3; do echo "cam$camera:"; tail -n 5 "$output/capture$camera"; done
fi
exit "$result"
