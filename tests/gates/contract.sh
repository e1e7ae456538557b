#!/usr/bin/env bash
# api/control.idl: each type, member and constant is described, and the reference in api/reference.md is up to date. It may have
# more than the first version, whose frozen text the tests have, but nothing that a program of that version does not understand.
# The version that the tests make from it may follow it. Usage: contract.sh [ROOT]; prints each fault.
set -euo pipefail
here=$(cd "$(dirname "$0")/../.." && pwd)
root=$(cd "${1:-$here}" && pwd)
wrong=0
python3 "$here/api/reference.py" --root "$root/api" --check || wrong=1
python3 "$here/api/reference.py" --root "$root/api" --compatible "$here/tests/integration/contract/control_v1.idl" || wrong=1
next=$(mktemp -d)
trap 'rm -rf "$next"' EXIT
python3 "$here/tests/integration/contract/next_version.py" "$root/api/control.idl" "$next/control.idl"
python3 "$here/api/reference.py" --root "$next" --compatible "$root/api/control.idl" || wrong=1
exit $wrong
