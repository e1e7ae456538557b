#!/usr/bin/env bash
# An unsecured host is for the loopback interface only, really: packets of another machine reach no socket, so no parser. With
# an explicit setting it does, and the log says what that means.
. "$(dirname "$0")/spaces.sh"
make_spaces inside outside
cable inside 10.78.0.1 outside 10.78.0.2

# junk SPACE ADDRESS: no RTPS, but looks like it, to all ports of the host; says which ones took it
junk() {
  within "$1" python3 - "$2" "$PLCHOST_DOMAIN" <<'EOF'
import socket, sys, time
address, first = sys.argv[1], 7400 + 250 * int(sys.argv[2])
for port in (first, first + 1, first + 10, first + 11):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect((address, port))
        taken = True
        end = time.monotonic() + 3  # the kernel tells of few refusals in a second
        while taken and time.monotonic() < end:
            try:  # a refusal comes back with the next call
                sender.send(b"RTPS\x02\x01\x01\x10" + 12 * b"\x01" + b"\x15\x01\xff\x00junk")
            except ConnectionRefusedError:
                taken = False
            time.sleep(0.1)
        if taken:
            print(port - first, end=" ")
EOF
}
start() {
  managers=()
  start_manager_within cell1 inside
  until_true 20 grep -q "is served in DDS domain" "$cell/cell1.log"
}
stop() {
  kill -TERM "${managers[0]}"
  wait "${managers[0]}" || fail "the manager ended with $?"
  managers=()
}
looked_at() { grep -qE "datagrams? (was|were) rejected|malformed packet" "$cell/cell1.log"; }

write_host cell1 "$first_core"
start
grep -q "unsecured, therefore on the loopback interface only" "$cell/cell1.log" || fail "it does not say that it is unsecured"
taken=$(junk outside 10.78.0.1)
is "$taken" "" || fail "these ports take packets from another machine: $taken"
looked_at && fail "a packet from another machine was looked at"
taken=$(junk inside 127.0.0.1)
is "$taken" "10 11 " || fail "from lo these ports take packets: $taken; the test looks at the wrong ones"
until_true 10 looked_at
stop

printf '[dds]\ninterface = "cable"\n' >>"$cell/cell1.toml"
refused_config() { "$BIN/plchostd" --check-config "$cell/cell1.toml"; }
refused "without an identity opens this controller to all who reach it" refused_config
printf 'allow_unsecured = true\nmulticast = false\n' >>"$cell/cell1.toml"
: >"$cell/cell1.log"
start
grep -q "any program that reaches it controls this host" "$cell/cell1.log" || fail "it does not say what that means"
taken=$(junk outside 10.78.0.1)
is "$taken" "10 11 " || fail "it was told to be open, and takes on ports: $taken"
until_true 10 looked_at
stop

# Discovery by multicast takes two ports more.
sed -i '/multicast/d' "$cell/cell1.toml"
: >"$cell/cell1.log"
start
taken=$(junk outside 10.78.0.1)
is "$taken" "0 1 10 11 " || fail "it looks for others by multicast, and takes on ports: $taken"
stop
nothing_left
