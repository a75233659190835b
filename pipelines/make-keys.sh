#!/usr/bin/env bash
# SPDX-License-Identifier: LGPL-2.1-or-later
# Keys for machines that trust each other and nobody else: an authority, and for each machine a
# certificate that it signs.
#   pipelines/make-keys.sh FOLDER NAME...
#     FOLDER  gets authority.pem, which every machine needs, and for each NAME a NAME.pem with that
#             machine's certificate and private key, which that machine alone needs
#     NAME    what the machine is called, or its address: what others connect to, or know it by
#             (tls-name)
# Run again for more machines; keys that are there stay. authority-key.pem signs new machines: keep it
# where none of them is. Certificates are good for ten years and cannot be called back: where a key is
# lost, make a new authority in another folder, and new keys for all other machines.
set -euo pipefail
fail() { printf 'make-keys.sh: %s\n' "$1" >&2; exit 2; }
case ${1:-} in
  -h | --help) sed -n '3,12s/^# \{0,1\}//p' "$0"; exit ;;
esac
[ $# -ge 2 ] || fail "expected a folder and the machines' names; --help says more"
command -v openssl > /dev/null || fail "openssl is not there: install the package openssl"
folder=$1
shift
umask 077
mkdir -p "$folder"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# openssl says much where nothing is wrong; what it says is shown where something is.
run() { openssl "$@" 2> "$work/said" || fail "openssl $1 failed: $(tail -n 3 "$work/said" | tr '\n' ' ')"; }
new_key=(-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -noenc)
if [ ! -e "$folder/authority.pem" ]; then
  run req -x509 "${new_key[@]}" -days 3650 -subj "/CN=polyhull machines" \
    -addext basicConstraints=critical,CA:TRUE -addext keyUsage=critical,keyCertSign,cRLSign \
    -keyout "$folder/authority-key.pem" -out "$folder/authority.pem"
  chmod 644 "$folder/authority.pem"
fi
[ -e "$folder/authority-key.pem" ] || fail "$folder/authority-key.pem is not there; it signs new machines"
for name in "$@"; do
  [ ${#name} -le 64 ] || fail "'$name' has ${#name} letters; a certificate's name has 64 at most"
  [[ $name =~ ^[A-Za-z0-9.:_-]+$ ]] || fail "'$name' is no name of a machine and no address"
  file=$folder/$name.pem
  [ ! -e "$file" ] || continue
  kind=DNS
  [[ ! $name =~ ^[0-9.]+$ && $name != *:* ]] || kind=IP
  run req "${new_key[@]}" -subj "/CN=$name" -keyout "$work/key.pem" -out "$work/request.pem"
  printf 'subjectAltName=%s:%s\nextendedKeyUsage=serverAuth,clientAuth\n' "$kind" "$name" > "$work/extensions"
  run x509 -req -in "$work/request.pem" -CA "$folder/authority.pem" -CAkey "$folder/authority-key.pem" \
    -CAcreateserial -days 3650 -extfile "$work/extensions" -out "$work/certificate.pem"
  cat "$work/certificate.pem" "$work/key.pem" > "$file"
  printf '%s\n' "$file"
done
