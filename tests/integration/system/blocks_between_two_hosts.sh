#!/usr/bin/env bash
# Two managers in two network namespaces with a cable between: their instances talk by address; a plchost-dds is
# killed, the cable is cut and mended; nobody waits for anybody.
. "$(dirname "$0")/spaces.sh"
make_spaces north south
cable north 10.77.0.1 south 10.77.0.2

# write_side HOST NUMBER PEER NODE_ADDRESS: a host with one instance that talks
write_side() {
  write_host "$1" "$first_core"
  cat >>"$cell/$1.toml" <<EOF
[dds]
interface = "cable"
allow_unsecured = true
peers = ["$3"]
[blocks]
host_number = $2
EOF
  printf '[CmpBlkDrvShm]\nForcedAddress=%s\nHoldMs=1000\n' "$4" >"$cell/$1.cfg"
  write_instance "$1" talker "$first_core" talker "settings = \"$cell/$1.cfg\"" 'share_core = true' 'scheduler = "CmpScheduleTimer"'
}
write_side north 1 10.77.0.2 11
write_side south 2 10.77.0.1 12

# Each sends requests to the other, one by address and one by name, and answers those of the other.
TALKER_ADDRESS=$((2 << 16 | 12)) start_manager_within north
TALKER_PEER=talker@north start_manager_within south
at() { # HOST COMMAND...: plcctl beside that host
  local host=$1
  shift
  local address=10.77.0.1
  if [ "$host" = south ]; then address=10.77.0.2; fi
  within "$host" "$BIN/plcctl" --timeout 10 --interface cable --peer "$address" --host "$host" "$@"
}
# The highest number that the instance of HOST has said before "WORD".
count_of() { grep -oE "[0-9]+ $2" "$cell/$1.log" | tail -n 1 | grep -oE '^[0-9]+' || echo 0; }
has_more() { [ "$(count_of "$1" "$2")" -gt "$3" ]; }
both_go_on() {
  local host before
  for host in north south; do
    before=$(count_of "$host" replies)
    until_true 30 has_more "$host" replies "$before"
  done
}
none_wrong() { ! grep -h 'wrong reply' "$cell"/*.log || fail "a reply was wrong"; }

echo "- requests and replies, both ways"
both_go_on
none_wrong
hosts_of_gateway() { at "$1" list nodes --json | jq -r '.[] | select(.name == "gateway") | .hosts'; }
reaches() { is "$(hosts_of_gateway "$1")" "$2"; }
until_true 30 reaches north 2
until_true 30 reaches south 1
at north show routes talker --json |
  jq -e '.[] | select(.to_hosts == "2") | .to_name == "gateway" and .sent > 0 and .sent_bytes > 0' >/dev/null ||
  fail "no way to host 2: $(at north show routes talker)"
echo "- a client from outside is served only if it was let in: on the loopback interface there is no host"
if within north "$BIN/plcctl" --timeout 1 list hosts 2>&1 | grep -q north; then
  fail "north answers on an interface that it was not told to use"
fi

echo "- a killed plchost-dds disturbs nothing and is back"
cycles() { at "$1" list tasks --json | jq -r '.[] | select(.task == "Talk") | .cycles'; }
lost_cycles() { at "$1" list tasks --json | jq -r '.[] | select(.task == "Talk") | .lost_cycles'; }
server_of() { pgrep -P "${managers[$1]}" plchost-dds; }
talker_of() { pgrep -P "${managers[$1]}" plc-instance; }
north_talker=$(talker_of 0)
kill -KILL "$(server_of 0)"
both_go_on
is "$(talker_of 0)" "$north_talker" || fail "the instance was started anew"

echo "- a cut cable: the senders are told, their cycles go on"
refused_so_far() { count_of "$1" "not sent"; }
before_north=$(refused_so_far north)
before_south=$(refused_so_far south)
before_cycles=$(count_of north cycles)
ip -n "$(space north)" link set cable down
until_true 30 has_more north "not sent" "$before_north"
until_true 30 has_more south "not sent" "$before_south"
until_true 30 has_more north cycles "$before_cycles"
sleep 4 # longer than DDS remembers a host that is silent
ip -n "$(space north)" link set cable up
both_go_on
none_wrong
is "$(talker_of 0)" "$north_talker" || fail "the instance was started anew"

echo "- a short cut"
ip -n "$(space south)" link set cable down
sleep 0.5
ip -n "$(space south)" link set cable up
both_go_on
none_wrong

for manager in "${managers[@]}"; do
  kill -TERM "$manager"
  wait "$manager" || fail "a manager ended with $?"
done
nothing_left
