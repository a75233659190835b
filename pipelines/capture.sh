#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# A capture machine: keys one camera and serves its views to the server, by the server's clock.
#   pipelines/capture.sh --camera NAME --server HOST[:PORT] --source "ELEMENTS" [OPTION...]
#     --camera NAME       its name in the rig file
#     --server HOST:PORT  who gives the clock (pipelines/server.sh); default port 7480; IPv6 in brackets: [fd00::1];
#                         ptp or ptp:DOMAIN: the network's PTP clock (server.sh --clock)
#     --source ELEMENTS   the camera, as gst-launch has it: "v4l2src device=/dev/video0 ! videoconvert"
#     --port N            the views are served on this TCP port; default 7481
#     --listen ADDRESS    only on this address; default all of IPv4; "::" has IPv6, too
#     --silhouette TEXT   properties of silhouette: "key-color=0x30a050 sigma=1.5"
#     --settings          the server may change them (server.sh --silhouette); needs keys
#     --link N            megabits a second to the server, this camera's part: how views are packed;
#                         default 1000, 0: not packed
#     --allow ADDRESSES   who may have them: "10.0.0.1 10.0.1.0/24"; default anybody
#     --certificate FILE  this machine's certificate and key, and
#     --authority FILE    who signs those of the machines that are trusted (pipelines/make-keys.sh)
#     --client NAMES      of those machines, whose certificate must be for one of these names: "server";
#                         default any
#     --dry-run           prints the line and does nothing
# One for each camera; several on one machine need a port each. How the parts meet: docs/network.md.
set -euo pipefail
source "$(dirname "$0")/prepare.sh"
polyhull_help "$@"

camera="" server="" source="" port=7481 listen=0.0.0.0 silhouette="" link=1000 dry_run=false
allow="" certificate="" authority="" client="" settings=false
while [ $# -gt 0 ]; do
  case $1 in
    --dry-run) dry_run=true; shift; continue ;;
    --settings) settings=true; shift; continue ;;
    --camera | --server | --source | --port | --listen | --silhouette | --link | --allow | --certificate | --authority | --client)
      [ $# -gt 1 ] || fail "$1 needs a value; --help says which" ;;
    *) fail "unknown argument '$1'; --help says what there is" ;;
  esac
  case $1 in
    --camera) camera=$2 ;;
    --server) server=$2 ;;
    --source) source=$2 ;;
    --port) port=$2 ;;
    --listen) listen=$2 ;;
    --silhouette) silhouette=$2 ;;
    --link) link=$2 ;;
    --allow) allow=$2 ;;
    --certificate) certificate=$2 ;;
    --authority) authority=$2 ;;
    --client) client=$2 ;;
  esac
  shift 2
done
[ -n "$camera" ] || fail "--camera NAME says which camera of the rig this is"
[ -n "$source" ] || fail "--source says what the camera is, as gst-launch has it; --help has an example"
[ -n "$server" ] || fail "--server HOST:PORT says who gives the clock"
[[ $server == ptp || ( $server == *:* && $server != *] ) ]] || server+=:7480
[[ $port =~ ^[0-9]+$ ]] && [ "$port" -gt 0 ] && [ "$port" -lt 65536 ] || fail "--port is '$port'; expected 1 to 65535"
[[ $link =~ ^(0|[1-9][0-9]*(\.[0-9]+)?)$ ]] || fail "--link is '$link'; expected megabits a second, 1 or more, or 0"

for file in "$certificate" "$authority"; do
  [ -z "$certificate$authority" ] || [ -f "$file" ] ||
    fail "--certificate and --authority need a file each; '$file' is none"
done
! $settings || [ -n "$certificate" ] ||
  fail "--settings needs --certificate and --authority: settings are taken only from who proves who it is"
[ -z "$client" ] || [ -n "$certificate" ] || fail "--client needs --certificate and --authority, which say who a client is"

# A server that takes nothing for two seconds, or is 50 views behind, is given up: it connects again.
# Words, but no names of files that they may look like.
set -f
# shellcheck disable=SC2206
line=($source ! queue ! silhouette name=keyer "camera=$camera" $silhouette !)
set +f
[ "$link" = 0 ] || line+=(viewencode "link=$link" !)
line+=(gdppay ! viewserversink "host=$listen" "port=$port")
! $settings || line+=(settings-for=keyer)
[ -z "$allow" ] || line+=("allow=$allow")
[ -z "$certificate$authority" ] || line+=("tls-certificate=$certificate" "tls-authority=$authority")
[ -z "$client" ] || line+=("tls-clients=$client")
if $dry_run; then
  printf 'polyhull-run --clock %q' "$server"
  printf ' %q' "${line[@]}"
  printf '\n'
  exit
fi
polyhull_programs polyhull-run
polyhull_environment
exec polyhull-run --clock "$server" "${line[@]}"
