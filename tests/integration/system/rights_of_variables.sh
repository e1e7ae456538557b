#!/usr/bin/env bash
# Engineers read, write and force variables, and other roles if the host's configuration says so. Each write and force is in the
# audit log with its principal.
. "$(dirname "$0")/common.sh"

plant=$cell/plant
export PLCHOST_SECURITY=$plant
as() { plcctl --identity "$plant/$1" "${@:2}"; }

plcctl security init "$plant" cell1 >/dev/null
plcctl security add-identity viewer panel >/dev/null
plcctl security add-identity operator anna >/dev/null
plcctl security add-identity engineer otto >/dev/null
write_host cell1 "$first_core"
printf '[dds]\nidentity = "plant/cell1"\n' >>"$cell/cell1.toml"
write_instance cell1 line1 "$first_core" line_variables
start_manager cell1
running() { is "$(as panel list instances --json | jq -r '.[0].state')" running; }
until_true 20 running
value() { asked as "$1" read variable line1 "$2" --json | jq -r '.[0].value'; }

echo "- engineers, if nothing is said"
is "$(value otto line.setpoint)" 20 || fail "$(value otto line.setpoint)"
as otto write variable line1 line.setpoint=21
as otto force variable line1 line.total=7
as otto unforce variable line1 line.total
for who in panel anna; do
  refused "this takes the role engineer ([host] read_variables of this host says so)" as "$who" read variable line1 line.setpoint
  refused "[host] read_variables" as "$who" list variables line1
  refused "[host] read_variables" as "$who" watch variables line1 line.setpoint --count 1
  refused "[host] read_variables" as "$who" record variables line1 line.setpoint --duration 0.1 --file "$cell/$who.csv"
  ! grep -q '[0-9]' "$cell/$who.csv" 2>/dev/null || fail "values without the right to them: $(cat "$cell/$who.csv")"
done
records() { asked as "$1" record variables line1 line.setpoint --duration 0.1 | tail -n 1 | cut -d, -f4; }
is "$(records otto)" 21 || fail "an engineer records $(records otto)"
code=0
as panel export plant >"$cell/plant.xml" 2>"$cell/export.log" || code=$?
is "$code" 1 || fail "exit code $code of an export without the right to read variables"
grep -q '<task name="' "$cell/plant.xml" || fail "the tasks are not exported: $(cat "$cell/export.log")"
grep -q "line1: exported without its variables: .*'panel' is viewer; this takes the role engineer" "$cell/export.log" || fail "$(cat "$cell/export.log")"
as otto export plant >"$cell/plant.xml" || fail "an engineer exports the plant"
grep -q 'variable name="setpoint"' "$cell/plant.xml" || fail "an engineer exports variables"
refused "'anna' is operator; this takes the role engineer ([host] write_variables of this host says so)" \
  as anna write variable line1 line.setpoint=22
refused "[host] write_variables" as anna force variable line1 line.setpoint=22
refused "[host] write_variables" as anna unforce variable line1 --all
is "$(value otto line.setpoint)" 21 || fail "a refused value was written: $(value otto line.setpoint)"

echo "- a client that may write and not read is told no values"
sed -i '/^pool = /a write_variables = "operator"' "$cell/cell1.toml"
as otto reload host >/dev/null
wrote() { as anna write variable line1 line.setpoint=21 >"$cell/wrote.txt" 2>&1; }
until_true 20 wrote
is "$(cat "$cell/wrote.txt")" "'line.setpoint' is written" || fail "$(cat "$cell/wrote.txt")"
is "$(as otto write variable line1 line.setpoint=21)" "'line.setpoint' is written: 21 -> 21" || fail "an engineer is told values"
refused "[host] read_variables" as anna read variable line1 line.setpoint
as anna logs line1 | grep -q "variable 'line.setpoint' is written$" || fail "$(as anna logs line1)"
as anna logs line1 | grep -q -- '-> 21' && fail "operators are told values by the log"
sed -i '/^write_variables = /d' "$cell/cell1.toml"
# The server of before serves until the next one is there: it would write, and record it.
old=$(pgrep -P "${managers[0]}" -x plchost-dds)
as otto reload host >/dev/null
another() { pgrep -P "${managers[0]}" -x plchost-dds | grep -qvx "$old"; }
until_true 20 another
refused "[host] write_variables" as anna write variable line1 line.setpoint=21

echo "- viewers and operators, by two keys of [host]"
sed -i '/^pool = /a read_variables = "viewer"\nwrite_variables = "operator"' "$cell/cell1.toml"
as otto reload host | grep -q '^\[host\] read_variables changed, used at once; plchost-dds is restarted' || fail "the answer of the reload"
reads() { is "$(value panel line.setpoint)" 21; }
until_true 20 reads
is "$(records panel)" 21 || fail "a viewer records $(records panel)"
as anna write variable line1 line.setpoint=23
as anna force variable line1 line.total=8
is "$(value panel line.total)" 8 || fail "$(value panel line.total)"
is "$(as panel list forces --json | jq -r 'map("\(.name)=\(.forced_value)") | join(" ")')" "line.total=8" || fail "$(as panel list forces)"
refused "plc/v1/op/request: the permissions of this identity do not allow it" as panel write variable line1 line.setpoint=24
as anna unforce variable line1 --all
is "$(value anna line.setpoint)" 23 || fail "$(value anna line.setpoint)"

echo "- a watch ends with the right to it, or with its identity"
# watches NAME: in the background, "$cell/NAME.watch"
watches() {
  "$BIN/plcctl" --identity "$plant/$1" watch variables line1 fast.count --interval 0.05 >"$cell/$1.watch" 2>&1 &
  others+=($!)
  seen() { [ "$(grep -c fast.count "$cell/$1.watch")" -gt 2 ]; }
  until_true 20 seen "$1"
}
watches panel
watcher=${others[-1]}
sed -i 's/^read_variables = .*/read_variables = "operator"/' "$cell/cell1.toml"
as otto reload host >/dev/null
code=0
wait "$watcher" || code=$?
is "$code" 1 || fail "exit code $code of a watch whose right has ended: $(tail -n 3 "$cell/panel.watch")"
grep -q "'panel' is viewer; this takes the role operator" "$cell/panel.watch" || fail "$(tail -n 3 "$cell/panel.watch")"
plcctl security add-identity engineer leaver >/dev/null
known() { as leaver read variable line1 fast.count; }
until_true 20 known
watches leaver
plcctl security revoke leaver >/dev/null
cut_off() { grep -q "has not answered" "$cell/leaver.watch"; }
until_true 20 cut_off
lines=$(wc -l <"$cell/leaver.watch")
is "$(value otto line.setpoint)" 23 || fail "others are not served any more"
sleep 1
is "$(wc -l <"$cell/leaver.watch")" "$lines" || fail "a revoked identity sees values: $(tail -n 3 "$cell/leaver.watch")"
kill "${others[-1]}"

echo "- in the audit log, each with its principal"
audit=$cell/cell1.state/audit.cell1
told() { cat "$1"/audit.*.log | jq -r 'select(.what | test("variable")) | "\(.who): \(.what) \(.argument)"'; }
is "$(told "$audit")" "engineer otto: write variable line.setpoint=21
engineer otto: force variable line.total=7
engineer otto: unforce variable line.total
operator anna: write variable line.setpoint=21
engineer otto: write variable line.setpoint=21
operator anna: write variable line.setpoint=23
operator anna: force variable line.total=8
operator anna: unforce variable *" || fail "$(told "$audit")"
told "$audit/refused" | grep -q '^operator anna: write variable line.setpoint=22$' || fail "$(told "$audit/refused")"
plcctl verify audit "$audit" >/dev/null || fail "$(plcctl verify audit "$audit")"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
