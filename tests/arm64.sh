#!/usr/bin/env bash
# Unit tests for arm64, on another processor: built by a cross compiler, and run in QEMU. That emulates programs,
# and leaves system calls to this kernel.   tests/arm64.sh [CTEST_OPTION...]
# Each case that QEMU cannot run has its reason in skips.txt, under the kind "emulated".
# It installs packages of arm64, so it runs in a Debian of its own: .ci/bare bookworm tests/arm64.sh
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' tests/arm64.sh; exit ;;
esac
export CCACHE_SLOPPINESS=pch_defines,time_macros  # or it would not cache what uses precompiled headers
export PYTHONDONTWRITEBYTECODE=1  # the tree of the sources stays as it was
build=.build/arm64
.ci/packages cross_test
launcher=()
if command -v ccache >/dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache); fi
cmake -S . -B "$build" -G Ninja --toolchain "$PWD/.cmake/arm64.cmake" "${launcher[@]}" -DCMAKE_COMPILE_WARNING_AS_ERROR=ON -DPLCHOST_TESTS=ON -DPLCHOST_OTHER_VENDOR=OFF \
  -DPLCHOST_BENCH=OFF -DPLCHOST_PYTHON=OFF -DPLCHOST_MANUALS=OFF -DPLCHOST_MODBUS=ON -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=20 \
  -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O2 -g1 -DNDEBUG --param ggc-min-heapsize=1000000"
cmake --build "$build" -j "$(nproc)" --target plchost_tests
tests/suite.py --jobs $(($(nproc) * 2)) "$build" -C whole -LE case "$@"
