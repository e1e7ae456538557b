#!/usr/bin/env bash
# The client of another vendor (Fast DDS) with DDS Security: an operator starts and posts, a viewer only reads. A
# client without an identity, or with one of another plant, sees nothing.
. "$(dirname "$0")/common.sh"

plant=$cell/plant
for folder in "$plant" "$cell/other"; do
  plcctl security init "$folder" cell >/dev/null
  PLCHOST_SECURITY=$folder plcctl security add-identity operator anna >/dev/null
done
PLCHOST_SECURITY=$plant plcctl security add-identity viewer panel >/dev/null

write_host cell "$first_core"
printf '[dds]\nidentity = "plant/cell"\n' >>"$cell/cell.toml"
write_instance cell packer1 "$first_core" packer 'share_core = true' 'autostart = false'
start_manager cell
as() { plcctl --identity "$plant/$1" "${@:2}"; }
offline() { is "$(as panel list instances --json | jq -r '.[0].state')" offline; }
until_true 20 offline

# vendor FOLDER...: as the identity of that folder; all that its program needs for that are properties
vendor() {
  local folder=$1 auth=dds.sec.auth.builtin.PKI-DH access=dds.sec.access.builtin.Access-Permissions property
  shift
  local properties=()
  for property in dds.sec.auth.plugin=builtin.PKI-DH dds.sec.access.plugin=builtin.Access-Permissions \
    dds.sec.crypto.plugin=builtin.AES-GCM-GMAC \
    "$auth.identity_ca=file://$folder/identity_ca.pem" "$auth.identity_certificate=file://$folder/certificate.pem" \
    "$auth.private_key=file://$folder/key.pem" "$access.permissions_ca=file://$folder/permissions_ca.pem" \
    "$access.governance=file://$folder/governance.p7s" "$access.permissions=file://$folder/permissions.p7s"; do
    properties+=(--property "$property")
  done
  "$BIN/fastdds_client" --domain "$PLCHOST_DOMAIN" "${properties[@]}" "$@" 2>>"$cell/vendor.log"
}

echo "- an operator sees, starts and posts"
is "$(vendor "$plant/anna" instances | cut -d' ' -f1,2)" "packer1 0" || fail "instances: $(vendor "$plant/anna" instances)"
vendor "$plant/anna" start packer1 || fail "start"
posted=$(vendor "$plant/anna" post packer1/product 100)
is "$posted" "accepted 100 no_task 0 rejected 0 " || fail "post: '$posted'"

echo "- a viewer sees, and can neither start nor post"
is "$(vendor "$plant/panel" instances | cut -d' ' -f1,2)" "packer1 2" || fail "a viewer sees nothing"
if vendor "$plant/panel" --patience 4 stop packer1; then fail "a viewer has stopped an instance"; fi
if vendor "$plant/panel" --patience 4 post packer1/product; then fail "a viewer has posted"; fi

echo "- nobody else sees anything"
if vendor "$cell/other/anna" --patience 4 hosts; then fail "an operator of another plant sees the host"; fi
if "$BIN/fastdds_client" --domain "$PLCHOST_DOMAIN" --patience 4 hosts 2>>"$cell/vendor.log"; then fail "a client without an identity sees the host"; fi
is "$(as panel list instances --json | jq -r '.[0].state')" running || fail "the instance is not running"
is "$(as panel list events --json | jq '.[] | select(.event == "product") | .posts')" 100 || fail "there are other posts"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
