#!/usr/bin/env bash
# The benchmark prints one JSON document, which names the missing measurements; figures.py makes tables of it. It leaves nothing
# behind.
. "$(dirname "$0")/common.sh"
source=$(cd "$(dirname "$0")/../../.." && pwd)
mkdir "$cell/tmp"

echo "- one array, with a row for each thing"
TMPDIR=$cell/tmp "$BIN/plchost-bench" --only start,poll --quick --rounds 2 --json "$cell/file.json" >"$cell/figures.json" 2>"$cell/bench.log" &
bench=$!
others+=("$bench")
wait "$bench" || fail "it ended with $?"
is "$(jq -s 'length' "$cell/figures.json")" 1 || fail "not one document"
is "$(jq -c '[.[].name]' "$cell/figures.json")" '["poll/CmpSchedule/500events","start/plc-instance"]' || fail "$(cat "$cell/figures.json")"
cmp "$cell/figures.json" "$cell/file.json" || fail "--json has something else"
# one ROW FILTER: of one row
one() { jq -c ".[] | select(.name | startswith(\"$1\")) | $2" "$cell/figures.json"; }
is "$(one start '[.rounds, .samples, .floor_samples, .p99_us, .ratio_p999]')" '[2,30,30,null,null]' || fail "$(one start .)"
is "$(one start '[(.p50_us > 0), (.ratio_p50 > 0), (.p50_us_rounds | length), (.targets[0].measured_rounds | length)]')" \
  '[true,true,2,2]' || fail "$(one start .)"
is "$(one start '.targets[0].unit')" '"ms"' || fail "$(one start .targets)"
is "$(one start '[.conditions.steal_percent | length]')" '[2]' || fail "$(one start .conditions)"
is "$(grep -c nan "$cell/bench.log" "$cell/figures.json" | cut -d: -f2 | xargs)" "0 0" || fail "it prints a figure that is none"

echo "- a part that needs a compiler for Structured Text says so, or measures"
text() { TMPDIR=$cell/tmp "$@" "$BIN/plchost-bench" --only structured_text --quick --rounds 1 >"$cell/text.json" 2>>"$cell/bench.log" || fail "no figures of Structured Text"; }
text env -u PLCHOST_MATIEC -u PLCHOST_STRUCPP
is "$(jq -c '[.[] | [.name, .p50_us, .note]]' "$cell/text.json")" \
  '[["structured_text/matiec",null,"skipped: PLCHOST_MATIEC names no folder of a compiler"],["structured_text/strucpp",null,"skipped: PLCHOST_STRUCPP names no folder of a compiler"]]' ||
  fail "$(cat "$cell/text.json")"
if [ -n "${PLCHOST_MATIEC:-}" ]; then
  text env -u PLCHOST_STRUCPP
  is "$(jq -c '[.[] | select(.p50_us > 0 and .ratio_p50 > 0 and .samples > 100) | .name] | sort' "$cell/text.json")" \
    '["structured_text/matiec/CmpSchedule/1ms","structured_text/matiec/CmpScheduleOneShot/1ms","structured_text/matiec/CmpScheduleTimer/1ms"]' ||
    fail "$(cat "$cell/text.json")"
fi

echo "- and tables of it"
"$source/tests/bench/figures.py" "$cell/figures.json" >"$cell/figures.md" || fail "no tables"
grep -qE '^\| `start/plc-instance` \| idle \| [0-9.,]+ \| - \| - \|' "$cell/figures.md" || fail "$(cat "$cell/figures.md")"

is "$(ls "$cell/tmp"; find /dev/shm -name "*plct-*-$bench-*")" "" || fail "left behind: $(ls "$cell/tmp")"
