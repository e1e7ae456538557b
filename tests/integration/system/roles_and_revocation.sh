#!/usr/bin/env bash
# A plant's identities from the first command to a revocation: the rights of each, and a PLC that runs on through it all.
. "$(dirname "$0")/common.sh"

plant=$cell/plant
export PLCHOST_SECURITY=$plant
as() { plcctl --identity "$plant/$1" "${@:2}"; }

PLCHOST_SECURITY=$cell/elsewhere plcctl security init "$plant" cell1 >/dev/null
[ ! -e "$cell/elsewhere" ] || fail "the environment goes before the argument"
plcctl security add-identity viewer panel >/dev/null
plcctl security add-identity operator anna >/dev/null
plcctl security add-identity engineer otto >/dev/null
is "$(plcctl security show --json | jq -r 'map(.name + " " + .role + " " + .state) | join(",")')" \
  "anna operator valid,cell1 host valid,otto engineer valid,panel viewer valid" || fail "the output of show"

write_host cell1 "$first_core"
printf '[dds]\nidentity = "plant/cell1"\n' >>"$cell/cell1.toml"
write_instance cell1 packer1 "$first_core" packer 'scheduler = "CmpScheduleTimer"'
"$BIN/plchostd" --check-config "$cell/cell1.toml" >/dev/null || fail "the configuration is not accepted"
start_manager cell1

running() { is "$(as panel list instances --json | jq -r '.[0].state')" running; }
until_true 20 running
pid=$(as panel list instances --json | jq -r '.[0].pid')

echo "- each role may do its own and no more"
refused "the permissions of this identity do not allow it" as panel post event packer1/product
as anna post event packer1/product --count 20
refused "the permissions of this identity do not allow it" as anna set scheduler packer1 CmpSchedule
as otto set scheduler packer1 CmpSchedule
refused "the permissions of this identity do not allow it" as anna load application packer1 "$APPLICATIONS/packer.so"
refused "the permissions of this identity do not allow it" as anna rollback application packer1
as otto load application packer1 "$APPLICATIONS/packer.so" >/dev/null || fail "an engineer may send an application"
is "$(as panel list applications --json | jq -r '.[0].by')" "engineer otto" || fail "$(as panel list applications)"
pid=$(as panel list instances --json | jq -r '.[0].pid')
echo "- a report has no secret; that of a viewer says that the log is missing"
as otto save report packer1 "$cell/report.json" >/dev/null || fail "no report"
is "$(jq -r '.instance[0].name, .missing[]' "$cell/report.json")" packer1 || fail "$(jq .missing "$cell/report.json")"
[ "$(jq '.log | length' "$cell/report.json")" -gt 0 ] || fail "the report has no log"
secrets() { find "$plant" -name '*.pem' -exec cat {} + | grep -v -e '-----' | grep . ; }
[ "$(secrets | wc -l)" -gt 20 ] || fail "the plant has no secrets"
! grep -qF -e PRIVATE -f <(secrets) "$cell/report.json" || fail "the report has a secret"
as panel save report packer1 "$cell/viewer.json" >/dev/null || fail "no report for a viewer"
jq -r '.missing[]' "$cell/viewer.json" | grep -q '^log: ' || fail "$(jq .missing "$cell/viewer.json")"
code=0
plcctl --timeout 2 list hosts 2>"$cell/unknown.txt" || code=$?
is "$code" 3 || fail "exit code $code without an identity"
grep -q "needs an --identity" "$cell/unknown.txt" || fail "it is not said that an identity is missing"

echo "- a revoked identity, a renewed host and a fresh client: the PLC runs on"
report() { as panel list tasks --json | jq -r '.[] | select(.task == "Report") | .cycles'; }
cycles=$(report)
cp -r "$plant/anna" "$cell/kept"
plcctl security revoke anna >/dev/null
left() { ! plcctl --identity "$cell/kept" --timeout 1 list hosts; }
until_true 20 left
plcctl security renew cell1 >/dev/null
plcctl security add-identity operator anna >/dev/null
started() { as anna post event packer1/product; }
until_true 20 started
is "$(as panel list instances --json | jq -r '.[0].pid')" "$pid" || fail "the instance is another process"
is "$(as panel list instances --json | jq -r '.[0].restarts')" 0 || fail "the instance was started again"
more() { [ "$(report)" -gt "$cycles" ]; }
until_true 10 more

echo "- a key that others read is refused where the configuration is checked"
chmod 644 "$plant/cell1/key.pem"
refused_config() { "$BIN/plchostd" --check-config "$cell/cell1.toml"; }
refused "chmod 600" refused_config

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
