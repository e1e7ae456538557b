#!/usr/bin/env bash
# The packages on a Debian without systemd as process 1: installed they are complete, a removal leaves the state, and a purge
# nothing.   tests/machine/installed.sh FOLDER    (from manager/package.sh; also those of another processor, with its emulator)
# As root. Packages that these depend on stay installed, so it runs in a Debian of its own: .ci/bare bookworm.
set -euo pipefail
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit ;;
esac
folder=$(realpath -e "${1:?usage: tests/machine/installed.sh FOLDER}")
export DEBIAN_FRONTEND=noninteractive
work=$(mktemp -d "${TMPDIR:-/tmp}/plchost-installed.XXXXXX")
log=$work/log
told=
clean_up() {
  local code=$?
  [ "$code" -eq 0 ] || [ -n "$told" ] || tail -n 30 "$log" >&2
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 130' INT TERM
fail() { told=yes; echo "FAILED: $*" >&2; exit 1; }
story() { echo "- $*"; }

processor=$(dpkg-deb -f "$(ls "$folder"/plchost_*.deb)" Architecture)
emulator=()
packages=("$folder"/*.deb)
if [ "$processor" != "$(dpkg --print-architecture)" ]; then
  case "$processor" in
    arm64) emulator=(qemu-aarch64) ;;
    *) fail "there is no emulator of $processor" ;;
  esac
  # The module needs a Python of its own processor, and one Debian has one Python only.
  packages=("$folder"/plchost_*.deb "$folder"/plchost-dev_*.deb "$folder"/lib*.deb)
fi
names=()
for package in "${packages[@]}"; do names+=("$(dpkg-deb -f "$package" Package):$processor"); done

files() {
  find / -xdev \( -path /proc -o -path /sys -o -path /dev -o -path /run -o -path /tmp -o -path /var/tmp -o -path /var/log -o -path /var/cache \
    -o -path /var/lib/apt -o -path /var/lib/dpkg -o -path "$PWD" -o -path "$folder" \) -prune -o -print | sort
  getent passwd
  getent group
}

story "what they depend on is installed first"
apt-get -q update >"$log" 2>&1
mapfile -t needed < <(apt-get -q -s install --no-install-recommends "${packages[@]}" | tee "$log" | awk '$1 == "Inst" { print $2 }' |
  grep -vxE "($(IFS='|' && echo "${names[*]%:*}"))(:$processor)?")
[ ${#needed[@]} -eq 0 ] || apt-get -q install -y --no-install-recommends "${needed[@]}" >"$log" 2>&1
files >"$work/before"

story "installed, each program starts, and finds its libraries and its configuration"
apt-get -q install -y --no-install-recommends "${packages[@]}" >"$log" 2>&1
version=$(dpkg-deb -f "${packages[0]}" Version)
for program in plchostd plchost-dds plc-instance plchost-modbus plcctl; do
  said=$("${emulator[@]}" "/usr/bin/$program" --version 2>&1) || fail "$program --version: $said"
  [[ $said == *"${version%%-*}"* ]] || fail "$program --version: $said"
  [ -e "/usr/share/man/man8/$program.8.gz" ] || [ -e "/usr/share/man/man1/$program.1.gz" ] || fail "$program has no manual page"
done
said=$("${emulator[@]}" /usr/bin/plchostd --check-config /etc/plchost/plchost.toml 2>&1) || fail "the configuration: $said"
for user in plchost-plc plchost-dds; do id "$user" >"$log" 2>&1 || fail "there is no user $user"; done
if [ ${#emulator[@]} -eq 0 ]; then
  python3 -c 'import plchost_client' >"$log" 2>&1 || fail "Python: $(cat "$log")"
fi

story "a removal leaves state and configuration"
mkdir -p /var/lib/plchost
echo kept >/var/lib/plchost/kept
apt-get -q remove -y "${names[@]}" >"$log" 2>&1
[ -e /var/lib/plchost/kept ] || fail "the state is gone"
[ -e /etc/plchost/plchost.toml ] || fail "the configuration is gone"
[ ! -e /usr/bin/plchostd ] || fail "the programs are there"

story "a purge leaves nothing"
dpkg --purge "${names[@]}" >"$log" 2>&1  # apt knows none of those that have left nothing
files >"$work/after"
left=$(diff "$work/before" "$work/after") || fail "left behind: $left"
echo "the packages for $processor are installed and purged: passed"
