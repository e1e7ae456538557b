#!/usr/bin/env bash
# A Cyclone DDS whose internals are not known is told when the project is configured: one of a release that nobody has looked
# at, or with other structures.
set -euo pipefail
root=$(cd "$(dirname "$0")/../../.." && pwd)
folder=$(mktemp -d "${TMPDIR:-/tmp}/plchost-system.XXXXXX")
trap 'rm -rf "$folder"' EXIT
without=(-DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON -DCMAKE_DISABLE_FIND_PACKAGE_pybind11=ON)
configure() { cmake -S "$root" -B "$folder/build" -G Ninja "${without[@]}" "$@" >"$folder/log" 2>&1; }
fail() { echo "FAILED: $*" >&2; tail -n 30 "$folder/log" >&2; exit 1; }

configure || fail "it does not configure"
cyclone=$(sed -n 's/^CycloneDDS_DIR:PATH=//p' "$folder/build/CMakeCache.txt")
mkdir "$folder/newer"
echo "include(\"$cyclone/CycloneDDSConfig.cmake\")" >"$folder/newer/CycloneDDSConfig.cmake"
printf 'set(PACKAGE_VERSION 0.10.99)\nset(PACKAGE_VERSION_COMPATIBLE TRUE)\n' >"$folder/newer/CycloneDDSConfigVersion.cmake"
said="Memory of clients that have ended is not freed"
! grep -qF "$said" "$folder/log" || fail "it does not know the Cyclone DDS of this machine"
configure -DCycloneDDS_DIR="$folder/newer" || fail "it does not configure with another Cyclone DDS"
tr -s ' \n' ' ' <"$folder/log" | grep -qF "The internals of Cyclone DDS 0.10.99 are not known; plchost is built without its mends of Cyclone. $said" || fail "it does not warn of another release"
header=dds/ddsi/ddsi_tkmap.h
mkdir -p "$folder/include/dds/ddsi"
sed 's/ddsrt_atomic_uint32_t m_refc;/char more[64]; &/' "/usr/include/$header" >"$folder/include/$header"
grep -q 'char more' "$folder/include/$header" || fail "nothing was planted in $header"
configure -DCycloneDDS_DIR="$cyclone" -DCMAKE_C_FLAGS="-I$folder/include" || fail "it does not configure with other structures"
tr -s ' \n' ' ' <"$folder/log" | grep -qF "are not those of the release; plchost is built without its mends of Cyclone. $said" || fail "it does not warn of other structures"
