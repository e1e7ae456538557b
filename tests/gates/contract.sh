#!/usr/bin/env bash
# api/control.idl: each type, member and constant is described, and the reference in api/reference.md is up to date. Nothing of
# the first version has changed; until it is released, its copy in the tests is api/control.idl. The version that the tests make
# from it may follow it. Usage: contract.sh [ROOT]; prints each fault.
set -euo pipefail
here=$(cd "$(dirname "$0")/../.." && pwd)
root=$(cd "${1:-$here}" && pwd)
wrong=0
python3 "$here/api/reference.py" --root "$root/api" --check || wrong=1
python3 "$here/api/reference.py" --root "$root/api" --compatible "$here/tests/integration/contract/control_v1.idl" || wrong=1
first=tests/integration/contract/control_v1.idl
cmp -s "$root/api/control.idl" "$here/$first" || { echo "$first is not up to date: copy api/control.idl, until the first release"; wrong=1; }
next=$(mktemp -d)
trap 'rm -rf "$next"' EXIT
python3 "$here/tests/integration/contract/next_version.py" "$root/api/control.idl" "$next/control.idl"
python3 "$here/api/reference.py" --root "$next" --compatible "$root/api/control.idl" || wrong=1
exit $wrong
