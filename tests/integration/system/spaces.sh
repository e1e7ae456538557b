# Network namespaces for the system tests, each a machine of its own as far as the network goes. Sourced in the place of
# common.sh; ends what it made. Names of namespaces are of the whole machine, therefore with the number of this process.
. "$(dirname "${BASH_SOURCE[0]}")/common.sh"

spaces=()
end_spaces() {
  clean_up
  local name
  for name in "${spaces[@]}"; do ip netns delete "$(space "$name")" 2>/dev/null || true; done
}
trap end_spaces EXIT

space() { echo "plchost-$1-$$"; }

# make_spaces NAME...
make_spaces() {
  local name
  for name; do
    ip netns add "$(space "$name")" 2>/dev/null || {
      echo "skipped: this process may make no network namespaces (it needs CAP_SYS_ADMIN and CAP_NET_ADMIN)"
      exit 77
    }
    spaces+=("$name")
    ip -n "$(space "$name")" link set lo up
  done
}

# within NAME COMMAND...
within() {
  local name
  name=$(space "$1")
  shift
  ip netns exec "$name" "$@"
}

# start_manager_within HOST [SPACE]: in the namespace of its name, or in another one
start_manager_within() {
  ip netns exec "$(space "${2:-$1}")" "$BIN/plchostd" --config "$cell/$1.toml" 2>>"$cell/$1.log" &
  managers+=($!)
}

# cable A ADDRESS_A B ADDRESS_B: a cable between two, "cable" at both ends
cable() {
  ip -n "$(space "$1")" link add name cable type veth peer name cable netns "$(space "$3")" || {
    echo "skipped: there are no veth pairs here"
    exit 77
  }
  address "$1" "$2"
  address "$3" "$4"
}
# address NAME ADDRESS: of its end of the cable
address() {
  ip -n "$(space "$1")" address add "$2/24" dev cable
  ip -n "$(space "$1")" link set cable up
}

# switch NAME...: these hang on one switch, by their "cable"; the n-th has the address 10.79.0.n. The switch's end of each
# is "to-NAME" in the namespace "switch".
switch() {
  make_spaces switch
  ip -n "$(space switch)" link add name bridge type bridge || {
    echo "skipped: there are no bridges here"
    exit 77
  }
  ip -n "$(space switch)" link set bridge up
  local name number=0
  for name; do
    number=$((number + 1))
    ip -n "$(space "$name")" link add name cable type veth peer name "to-$name" netns "$(space switch)"
    ip -n "$(space switch)" link set "to-$name" master bridge
    ip -n "$(space switch)" link set "to-$name" up
    address "$name" "10.79.0.$number"
  done
}
# unplug NAME, plug NAME: its cable at the switch
unplug() { ip -n "$(space switch)" link set "to-$1" down; }
plug() { ip -n "$(space switch)" link set "to-$1" up; }
