#!/usr/bin/env bash
# The demo runs to its end, and says what the README shows of it.
. "$(dirname "$0")/common.sh"
root=$(cd "$(dirname "$0")/../../.." && pwd)
TMPDIR=$cell "$root/manager/demo.sh" --build "$BIN/.." >"$cell/demo.log" 2>&1 || fail "the demo"
"$(dirname "$0")/demo_of_the_readme.py" "$root/README.md" "$cell/demo.log" || fail "the README's block"
