#!/bin/bash
# Installs the Debian packages that are absent, with fresh lists only where the old ones do not do.
# usage: install.sh PACKAGE...
command -v dpkg-query >/dev/null || { echo "deps: no dpkg here; install these by hand: $*"; exit 0; }
missing=()
for package in "$@"; do
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

echo "deps: installing ${missing[*]}"
as_root=$([ "$(id -u)" = 0 ] || echo sudo)
apt() { $as_root env DEBIAN_FRONTEND=noninteractive apt-get -q "$@"; }
add() { apt install -y --no-install-recommends "${missing[@]}"; }
log=$(mktemp)
trap 'rm -f "$log"' EXIT
{ add || { apt update && add; }; } >"$log" 2>&1 && exit 0
tail -n 5 "$log"
echo "deps: apt-get failed; install by hand: ${missing[*]}"
exit 1
