# For arm64 on another processor, with Debian's multiarch packages (.ci/packages cross): cmake --toolchain .cmake/arm64.cmake
# What runs during the build, and the tests, run in QEMU.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(PKG_CONFIG_EXECUTABLE /usr/bin/aarch64-linux-gnu-pkg-config)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 CACHE STRING "Starts programs for arm64")
# Python tells how modules are called there.
set(ENV{_PYTHON_SYSCONFIGDATA_NAME} _sysconfigdata__aarch64-linux-gnu)
