#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# GenICam cameras (GigE Vision, USB3 Vision) to a live textured hull.
#   pipelines/cameras-aravis.sh --rig FILE --cameras "NAME=ADDRESS ..." [OPTION...]
#     --rig FILE          the rig file; NAME is a camera of it
#     --cameras LIST      2 to 16 cameras: NAME=ADDRESS, ADDRESS as arv-tool-0.8 lists it, or an IP address
#     --trigger SOURCE    Line0, Line1 ... (an edge on that input starts each exposure), Software (a command
#                         that the application gives), or off (default: cameras run freely)
#     --pulses DEVICE     a serial device that gives the pulses (serialtrigger) and numbers the frames; with
#                         --trigger LineN
#     --delay MS          from a pulse to its frame's arrival at least; default 12 (see triggerstamp)
#     --rate N            frames per second; default 25
#     --exposure US       default 4000
#     --gain DB           default 0
#     --white-balance R,B gains of red and blue; default: the camera's own
#     --format CAPS       default video/x-bayer,format=rggb
#     --ptp               the cameras' clocks follow PTP
#     --features TEXT     further GenICam assignments, separated by spaces
#     --sink ELEMENTS     what takes the meshes; default fakesink
#     --dry-run           prints the line and does nothing
# What each does, and what was tried with real cameras: docs/cameras.md.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
source "$(dirname "$0")/cameras.sh"
polyhull_help "$@"

trigger=off pulses="" delay=12 exposure=4000 gain=0 white_balance="" format=video/x-bayer,format=rggb ptp=false features=""
option() {
  case $1 in
    --trigger) trigger=$2 ;;
    --pulses) pulses=$2 ;;
    --delay) delay=$2 ;;
    --exposure) exposure=$2 ;;
    --gain) gain=$2 ;;
    --white-balance) white_balance=$2 ;;
    --format) format=$2 ;;
    --features) features=$2 ;;
    --ptp) ptp=true; return 1 ;;
    *) return 2 ;;
  esac
}
cameras_options "$@"
[[ $trigger =~ ^(off|Software|Line[0-9]+)$ ]] || fail "--trigger is '$trigger'; expected off, Software, Line0, Line1 and so on"
[ -z "$pulses" ] || [[ $trigger == Line* ]] || fail "--pulses gives pulses on a line; say which with --trigger Line1"
cameras_number --exposure "$exposure"
cameras_number --gain "$gain"
cameras_number --delay "$delay"
[ -z "$white_balance" ] || [[ $white_balance =~ ^[0-9.]+,[0-9.]+$ ]] ||
  fail "--white-balance is '$white_balance'; expected two gains, of red and blue, as in 1.4,1.7"

settings=""
if [ "$trigger" = off ]; then
  settings+=" TriggerMode=Off"
else
  settings+=" TriggerSelector=FrameStart TriggerSource=$trigger"
  # The usual circuit pulls the input low (docs/elements/serialtrigger.md).
  [ "$trigger" = Software ] || settings+=" TriggerActivation=FallingEdge"
  settings+=" TriggerMode=On"
fi
[ -z "$white_balance" ] ||
  settings+=" BalanceRatioSelector=Red BalanceRatio=${white_balance%,*} BalanceRatioSelector=Blue BalanceRatio=${white_balance#*,}"
! $ptp || settings+=" PtpEnable=true"
settings+=${features:+ $features}

line=(hullbuild name=hull "rig=$rig" ! hulltexture ! $sink)
[ -z "$pulses" ] || line+=(serialtrigger "device=$pulses" mode=break "rate=$rate/1")
for camera in "${cameras[@]}"; do
  # Its own times begin at 0 with each camera's first frame: steadystamp mends that; pulses are compared
  # with the times of fetching. On a trigger it must not set the rate.
  caps=$format
  [ "$trigger" != off ] || caps+=",framerate=$rate/1"
  line+=(aravissrc "camera-name=${camera#*=}" "do-timestamp=$([ -z "$pulses" ] && echo false || echo true)" "exposure=$exposure" "gain=$gain" "features=${settings# }" ! "$caps" !)
  [ -n "$pulses" ] || line+=(steadystamp !)
  [ -z "$pulses" ] || line+=(triggerstamp "delay=$(awk -v ms="$delay" 'BEGIN { printf "%.0f", ms * 1e6 }')" !)
  line+=(queue ! silhouette "camera=${camera%%=*}" ! hull.)
done

cameras_present() {
  gst-inspect-1.0 aravissrc >/dev/null 2>&1 || fail "there is no aravissrc; install Debian's libaravis-0.8-0"
  command -v arv-tool-0.8 >/dev/null || return 0
  local found camera
  found=$(timeout 30 arv-tool-0.8 2>/dev/null || true)
  for camera in "${cameras[@]}"; do
    grep -qF -- "${camera#*=}" <<<"$found" ||
      fail "camera ${camera%%=*} (${camera#*=}) does not answer; there are: ${found:-none}"
  done
}
cameras_run
