#!/usr/bin/env bash
# Makes a wrong variant of a file. Usage: plant.sh SCRIPT FILE RESULT. The script of sed sees the file as one line; if it
# changes nothing, the file is no longer what the fault was made for.
set -euo pipefail
mkdir -p "$(dirname "$3")"
sed -z -E -f "$1" "$2" >"$3.new"
if cmp -s "$2" "$3.new"; then
  echo "$1: the place of the fault is not in $2" >&2
  exit 1
fi
mv "$3.new" "$3"
