#!/usr/bin/env bash
# With only the packages of `.ci/packages need` the project is configured, and says which parts are left out. A part that an option
# requires is an error. The packages are hidden from CMake here; the rest of the machine is as it is.
. "$(dirname "$0")/common.sh"
source=$(cd "$(dirname "$0")/../../.." && pwd)
log=$cell/configure.log

# configured OPTION...: by a fresh configuration
configured() { rm -rf "$cell/build" && cmake -S "$source" -B "$cell/build" "$@" >"$log" 2>&1; }
says() { tr -s '\n ' ' ' <"$log" | grep -qF -- "$1" || fail "it does not say: $1"; }
hidden() { printf -- '-DCMAKE_DISABLE_FIND_PACKAGE_%s=ON\n' "$@"; }
mapfile -t all < <(hidden help2man libmodbus Python pybind11 GTest FastDDS iceoryx_posh)

echo "- nothing but the packages of the build"
configured "${all[@]}" || fail "not configured"
says "Without plchost-modbus: libmodbus is not installed"
says "Without the manual pages of plchostd, plchost-dds and plc-instance: help2man is not installed"
says "Without the module for Python: Python/Interpreter/Development.Module is not installed"
says "Without the tests: GTest::gmock is not installed"
says "Without iceoryx in the benchmarks: iceoryx_posh 2.0 is not installed"
says "With the benchmarks"

echo "- the tests without a DDS of another vendor"
configured "$(hidden FastDDS)" -DPLCHOST_TESTS=ON || fail "not configured"
says "Without the tests with a client of another vendor's DDS: FastDDS is not installed"
! cmake --build "$cell/build" --target help | grep -q fastdds_client || fail "there is a client of Fast DDS"

echo "- GoogleTest without GoogleMock, which the tests are linked with"
mkdir "$cell/gtest"
echo 'add_library(GTest::gtest INTERFACE IMPORTED)' >"$cell/gtest/GTestConfig.cmake"
configured -DGTest_DIR="$cell/gtest" || fail "not configured"
says "Without the tests: GTest::gmock is not installed"

echo "- GoogleTest without Cyclone's plugin for permissions, which tests load"
configured "$(hidden CycloneAccessControl)" || fail "not configured"
says "Without the tests: CycloneAccessControl is not installed"

echo "- a part that an option requires"
# refused OPTION MESSAGE PACKAGE...: it is ON, and these packages are not there
refused() {
  local option=$1 message=$2
  shift 2
  mapfile -t packages < <(hidden "$@")
  ! configured "${packages[@]}" "-D$option=ON" || fail "$option=ON without $*"
  says "$message"
}
refused PLCHOST_MODBUS "libmodbus is not installed: plchost-modbus cannot be built" libmodbus
refused PLCHOST_MANUALS "help2man is not installed: the manual pages" help2man
refused PLCHOST_PYTHON "pybind11 2.10 is not installed: the module for Python" pybind11
refused PLCHOST_TESTS "GTest::gmock is not installed: the tests cannot be built" GTest
refused PLCHOST_OTHER_VENDOR "FastDDS is not installed: the tests with a client" FastDDS
refused PLCHOST_ICEORYX "iceoryx_posh 2.0 is not installed: iceoryx" iceoryx_posh
