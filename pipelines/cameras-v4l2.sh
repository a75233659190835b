#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# V4L2 cameras (UVC, CSI, capture cards) to a live textured hull.
#   pipelines/cameras-v4l2.sh --rig FILE --cameras "NAME=/dev/videoN ..." [OPTION...]
#     --rig FILE          the rig file; NAME is a camera of it
#     --cameras LIST      2 to 16 cameras: NAME=DEVICE
#     --pulses DEVICE     a serial device that gives trigger pulses (serialtrigger) and numbers the frames; the
#                         cameras' own trigger control goes into --controls
#     --delay MS          from a pulse to its frame's time at least; default 0 (see triggerstamp)
#     --rate N            frames per second; default 25
#     --exposure US       default 4000
#     --gain N            default: the camera's own
#     --white-balance K   colour temperature; default 5000
#     --format CAPS       default image/jpeg,width=1280,height=720; video/x-raw and video/x-bayer go in directly
#     --controls TEXT     further controls, NAME=VALUE,NAME=VALUE, as v4l2-ctl --list-ctrls names them
#     --sink ELEMENTS     what takes the meshes; default fakesink
#     --dry-run           prints the line and does nothing
# What each does, and what was tried with real cameras: docs/cameras.md.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
source "$(dirname "$0")/cameras.sh"
polyhull_help "$@"

pulses="" delay=0 exposure=4000 gain="" white_balance=5000 format=image/jpeg,width=1280,height=720 controls=""
option() {
  case $1 in
    --pulses) pulses=$2 ;;
    --delay) delay=$2 ;;
    --exposure) exposure=$2 ;;
    --gain) gain=$2 ;;
    --white-balance) white_balance=$2 ;;
    --format) format=$2 ;;
    --controls) controls=$2 ;;
    *) return 2 ;;
  esac
}
cameras_options "$@"
cameras_number --exposure "$exposure"
cameras_number --delay "$delay"
cameras_number --white-balance "$white_balance"
[ -z "$gain" ] || cameras_number --gain "$gain"

# 1 is manual; the unit of exposure is 100 us.
settings="c,auto_exposure=1,exposure_time_absolute=$(awk -v us="$exposure" 'BEGIN { n = int(us / 100 + 0.5); print n < 1 ? 1 : n }')"
settings+=",white_balance_automatic=0,white_balance_temperature=$white_balance${gain:+,gain=$gain}${controls:+,$controls}"
decoder=()
case $format in
  image/jpeg*) decoder=(jpegdec !) ;;
esac

line=(hullbuild name=hull "rig=$rig" ! hulltexture ! $sink)
[ -z "$pulses" ] || line+=(serialtrigger "device=$pulses" mode=break "rate=$rate/1")
for camera in "${cameras[@]}"; do
  line+=(v4l2src "device=${camera#*=}" "extra-controls=$settings" ! "$format,framerate=$rate/1" !)
  [ -z "$pulses" ] || line+=(triggerstamp "delay=$(awk -v ms="$delay" 'BEGIN { printf "%.0f", ms * 1e6 }')" !)
  line+=(queue ! "${decoder[@]}" silhouette "camera=${camera%%=*}" ! hull.)
done

cameras_present() {
  local camera
  for camera in "${cameras[@]}"; do
    [ -c "${camera#*=}" ] || fail "camera ${camera%%=*}: there is no device ${camera#*=}; there are: $(ls /dev/video* 2>/dev/null || echo none)"
  done
}
cameras_run
