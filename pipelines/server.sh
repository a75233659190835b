#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# The server of capture machines: gives them its clock, takes their views, builds and colours the hull.
#   pipelines/server.sh --rig FILE --cameras "NAME=HOST[:PORT] ..." [OPTION...]
#     --rig FILE          the rig file; NAME is a camera of it
#     --cameras LIST      2 to 64 capture machines; default port 7481; IPv6 in brackets: left=[fd00::5]:7481
#     --clock-port N      UDP port of the clock; default 7480
#     --clock ptp[:N]     gives no clock but follows the network's PTP clock, of domain N (default 0), as the
#                         capture machines do then (capture.sh --server ptp[:N])
#     --max-wait MS       how long an instant waits for a late view; default 100
#     --max-rate N        bytes a second from one camera at most; default 200000000
#     --certificate FILE  this machine's certificate and key, and
#     --authority FILE    who signs those of the capture machines (pipelines/make-keys.sh), of which each is
#                         for its NAME
#     --tls-name WHAT     address: certificates are for the addresses; name: for the NAMEs (default)
#     --silhouette TEXT   properties that the capture machines' silhouettes are to have: "sigma=1.5", where
#                         they allow it (capture.sh --settings)
#     --trigger TEXT      this machine fires the capture machines' cameras: properties of serialtrigger, such
#                         as "device=/dev/ttyS0 rate=25/1"; sets meet by the pulses' numbers then
#     --stamp TEXT        properties of triggerstamp, by which frames find their pulse: "delay=20000000"
#     --sink ELEMENTS     what takes the meshes; default fakesink
#     --dry-run           prints the line and does nothing
# A capture machine that is cut off is left out and comes back by itself. How the parts meet:
# docs/network.md.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
polyhull_help "$@"

rig="" list="" clock_port=7480 clock="" max_wait=100 max_rate=200000000 sink=fakesink dry_run=false
certificate="" authority="" tls_name=name silhouette="" trigger="" stamp=""
while [ $# -gt 0 ]; do
  case $1 in
    --dry-run) dry_run=true; shift; continue ;;
    --rig | --cameras | --clock-port | --clock | --max-wait | --max-rate | --sink | --certificate | --authority | --tls-name | --silhouette | --trigger | --stamp)
      [ $# -gt 1 ] || fail "$1 needs a value; --help says which" ;;
    *) fail "unknown argument '$1'; --help says what there is" ;;
  esac
  case $1 in
    --rig) rig=$2 ;;
    --cameras) list=$2 ;;
    --clock-port) clock_port=$2 ;;
    --clock) clock=$2 ;;
    --max-wait) max_wait=$2 ;;
    --max-rate) max_rate=$2 ;;
    --sink) sink=$2 ;;
    --certificate) certificate=$2 ;;
    --authority) authority=$2 ;;
    --tls-name) tls_name=$2 ;;
    --silhouette) silhouette=$2 ;;
    --trigger) trigger=$2 ;;
    --stamp) stamp=$2 ;;
  esac
  shift 2
done
[ -n "$rig" ] || fail "--rig FILE says where the cameras stand; --help says what else there is"
[ -f "$rig" ] || fail "the rig file '$rig' does not exist"
for number in "--clock-port $clock_port" "--max-wait $max_wait" "--max-rate $max_rate"; do
  [[ $number =~ ^--[a-z-]+\ [0-9]+$ ]] || fail "${number% *} is '${number#* }'; expected a whole number"
done
for file in "$certificate" "$authority"; do
  [ -z "$certificate$authority" ] || [ -f "$file" ] ||
    fail "--certificate and --authority need a file each; '$file' is none"
done
[[ -z $clock || $clock =~ ^ptp(:[0-9]{1,3})?$ ]] || fail "--clock is '$clock'; expected ptp or ptp:DOMAIN"
[ -z "$silhouette" ] || [ -n "$certificate" ] ||
  fail "--silhouette needs --certificate and --authority: capture machines take settings only from who proves who it is"
[ -z "$stamp" ] || [ -n "$trigger" ] || fail "--stamp needs --trigger, whose pulses frames answer to"
[[ $tls_name == name || $tls_name == address ]] || fail "--tls-name is '$tls_name'; expected name or address"
read -ra cameras <<<"$list"
[ ${#cameras[@]} -ge 2 ] && [ ${#cameras[@]} -le 64 ] ||
  fail "--cameras names ${#cameras[@]} cameras; expected 2 to 64 as NAME=HOST:PORT, separated by spaces"
# Words, but no names of files that they may look like.
set -f
# shellcheck disable=SC2206
line=(hullbuild name=hull "rig=$rig" "max-wait=$((10#$max_wait * 1000000))" ! hulltexture ! $sink)
numbers=()
if [ -n "$trigger" ]; then
  # shellcheck disable=SC2206
  line+=(serialtrigger $trigger) numbers=(triggerstamp $stamp !)
fi
set +f
seen=" "
for camera in "${cameras[@]}"; do
  name=${camera%%=*} address=${camera#*=}
  [[ $camera == ?*=?* ]] || fail "--cameras has '$camera'; expected NAME=HOST:PORT"
  [[ $seen != *" $name "* ]] || fail "--cameras names '$name' twice"
  grep -qF "\"$name\"" "$rig" || fail "the rig file '$rig' has no camera '$name'"
  seen+="$name "
  [[ $address == *:* && $address != *] ]] || address+=:7481
  host=${address%:*} port=${address##*:}
  # An IPv6 address has colons of its own.
  [[ $host != \[*\] ]] || host=${host:1:-1}
  [[ $host != *:* || $address == \[* ]] || fail "--cameras has '$camera'; an IPv6 address needs brackets: NAME=[$address]:7481"
  [[ $port =~ ^[0-9]{1,5}$ ]] || fail "--cameras has '$camera'; its port is '$port', expected a number"
  keys=()
  if [ -n "$certificate" ]; then
    keys=("tls-certificate=$certificate" "tls-authority=$authority")
    [ $tls_name = address ] || keys+=("tls-name=$name")
  fi
  [ -z "$silhouette" ] || keys+=("settings=$silhouette")
  line+=(viewclientsrc "name=$name" "camera=$name" "host=$host" "port=$port" "max-rate=$max_rate" "${keys[@]}" ! queue ! viewdecode ! "${numbers[@]}" queue ! hull.)
done
by=(--clock-server "$clock_port")
[ -z "$clock" ] || by=(--clock "$clock")
if $dry_run; then
  printf 'polyhull-run %s %q' "${by[@]}"
  printf ' %q' "${line[@]}"
  printf '\n'
  exit
fi
polyhull_programs polyhull-run
polyhull_environment
exec polyhull-run "${by[@]}" "${line[@]}"
