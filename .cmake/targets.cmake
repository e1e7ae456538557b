# One place that says how every target of ours is compiled. Warnings are errors in the builds of tests/run.sh only, by
# CMAKE_COMPILE_WARNING_AS_ERROR: a compiler of tomorrow has warnings that nobody has seen yet.

set(PLCHOST_WARNINGS
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wcast-align -Wcast-qual
    -Wformat=2 -Wundef -Wvla -Wswitch-enum)
set(PLCHOST_CXX_WARNINGS
    -Wnon-virtual-dtor -Woverloaded-virtual -Wold-style-cast -Wextra-semi -Wzero-as-null-pointer-constant)

# The heavy headers of others are read once. They are third-party or the standard library's: nothing of ours is in
# them, so no file of ours compiles only because of this.
file(WRITE ${CMAKE_BINARY_DIR}/headers.cpp "")
function(plchost_headers name)
  add_library(${name} STATIC ${CMAKE_BINARY_DIR}/headers.cpp)
  target_link_libraries(${name} PRIVATE fmt::fmt spdlog::spdlog Threads::Threads)
  plchost_options(${name})
  plchost_kept_headers(${name})
  target_precompile_headers(${name} PRIVATE <algorithm> <array> <atomic> <chrono> <expected> <filesystem> <functional>
    <map> <memory> <optional> <ranges> <span> <string> <string_view> <thread> <utility> <vector> <fmt/format.h> <nlohmann/json.hpp> <spdlog/spdlog.h> ${ARGN})
endfunction()

# A compiler cache gives back what was made of an older file with the same text.
function(plchost_kept_headers name)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    target_compile_options(${name} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
  endif()
endfunction()

function(plchost_options name)
  target_compile_options(${name} PRIVATE ${PLCHOST_WARNINGS} $<$<COMPILE_LANGUAGE:CXX>:${PLCHOST_CXX_WARNINGS}>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    # libstdc++ 12 uses what it has itself declared deprecated; g++ does not mind in its own headers, clang does.
    target_compile_options(${name} PRIVATE -Wno-deprecated-declarations)
  endif()
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  if(SANITIZER)
    list(JOIN SANITIZER "," sanitizers)
    # g++ and clang have different ways to ask for it.
    foreach(kind address thread)
      string(TOUPPER ${kind} macro)
      if(kind IN_LIST SANITIZER)
        target_compile_definitions(${name} PRIVATE PLCHOST_${macro}_SANITIZER)
      endif()
    endforeach()
    target_compile_options(${name} PRIVATE -fsanitize=${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer
      -fno-sanitize=vptr)  # needs the C++ library, which programs in C do not have
    if("undefined" IN_LIST SANITIZER AND CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
      # Each access has these two. With a report they take a tenth of the time of the compiler; so they end by SIGILL.
      target_compile_options(${name} PRIVATE -fsanitize-trap=null,alignment)
    endif()
    target_link_options(${name} PUBLIC -fsanitize=${sanitizers})
    if("thread" IN_LIST SANITIZER AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # The seqlock's fences: every access beside them is atomic, so nothing is hidden by this.
      target_compile_options(${name} PRIVATE -Wno-tsan)
    endif()
  endif()
endfunction()

# plchost_library(NAME SOURCES... LINKS ...)
function(plchost_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINKS" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_link_libraries(${name} PUBLIC ${arg_LINKS})
  plchost_options(${name})
  target_precompile_headers(${name} REUSE_FROM plchost_headers)
endfunction()

# plchost_program(NAME SOURCES... LINKS ... [HEADERS TARGET]): TARGET is one of plchost_headers()
function(plchost_program name)
  cmake_parse_arguments(arg "" "HEADERS" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINKS})
  plchost_options(${name})
  if(arg_HEADERS)
    # A target that uses precompiled headers must be compiled as they were: for a library.
    set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(${name} PRIVATE -fPIC)
    target_precompile_headers(${name} REUSE_FROM ${arg_HEADERS})
  endif()
endfunction()

# plchost_command_line(FILE...): files that include CLI11, which compiles in ten seconds, half of them to make fast what
# runs once. Without optimisation anyway they are compiled together with others.
function(plchost_command_line)
  if(NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -O0 SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# plchost_quick_to_build(LIBRARY): one that runs once for each command of a person. -O2 takes a quarter longer to compile.
# Since version 13 g++ takes the precompiled headers of -O2 with -O2 only.
function(plchost_quick_to_build name)
  set(is_strict $<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,13>>)
  if(NOT CMAKE_BUILD_TYPE STREQUAL "Debug")
    target_compile_options(${name} PRIVATE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<NOT:${is_strict}>>:-O1>)
  endif()
endfunction()

# plchost_manual(PROGRAM WHAT): its manual page in section 8, from what its --help says, where man(1) looks: beside the folders
# in PATH. Without help2man there is none.
function(plchost_manual program what)
  if(NOT PLCHOST_MANUALS)
    return()
  endif()
  set(folder ${CMAKE_BINARY_DIR}/share/man/man8)
  # help2man starts what it is given by a shell. An emulator is used as CMake uses it: for another processor only.
  set(started $<TARGET_FILE:${program}>)
  if(CMAKE_CROSSCOMPILING AND CMAKE_CROSSCOMPILING_EMULATOR)
    string(JOIN " " started ${CMAKE_CROSSCOMPILING_EMULATOR} ${started})
  endif()
  add_custom_command(TARGET ${program} POST_BUILD COMMAND ${CMAKE_COMMAND} -E make_directory ${folder}
    COMMAND ${HELP2MAN} --no-info --section 8 --source plchost --name ${what} --output ${folder}/${program}.8
            ${started} VERBATIM)
endfunction()

# A control program: a shared object that plc-instance loads. Unique symbols would survive dlclose
# and be shared between programs, so they are off; the runtime's functions are found at load. Its tasks share variables without a
# lock, as IEC 61131-3 has it, so the thread sanitizer judges the runtime only.
function(plchost_application name)
  cmake_parse_arguments(arg "" "" "SOURCES" ${ARGN})
  add_library(${name} MODULE ${arg_SOURCES})
  set_target_properties(${name} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/applications)
  plchost_application_options(${name})
  if(TARGET plchost_application_headers AND arg_SOURCES MATCHES "\\.cpp")
    target_precompile_headers(${name} REUSE_FROM plchost_application_headers)
  endif()
endfunction()
function(plchost_application_options name)
  target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
  plchost_options(${name})
  if("thread" IN_LIST SANITIZER)
    target_compile_options(${name} PRIVATE -fno-sanitize=thread)
  endif()
endfunction()

# plchost_optional(OPTION WHAT NEED...): an option that is AUTO becomes ON if all that it needs is found, else OFF. Either is
# said. If the option is ON, an absence is an error. NEED: PACKAGE, "PACKAGE VERSION", PACKAGE/COMPONENT... or PACKAGE::TARGET.
function(plchost_optional option what)
  if(NOT ${option})
    message(STATUS "Without ${what}: ${option}=OFF")
    return()
  endif()
  foreach(need ${ARGN})
    string(REGEX MATCH "^[^ /:]+" package ${need})
    if(need MATCHES "::")
      find_package(${package} QUIET)
      set(is_there OFF)
      if(TARGET ${need})
        set(is_there ON)
      endif()
    else()
      string(REGEX REPLACE "^([^/]+)/" "\\1;COMPONENTS;" arguments ${need})
      string(REGEX REPLACE "[ /]" ";" arguments "${arguments}")
      find_package(${arguments} QUIET)
      set(is_there ${${package}_FOUND})
    endif()
    if(NOT is_there)
      if(NOT ${option} STREQUAL "AUTO")
        message(FATAL_ERROR "${need} is not installed: ${what} cannot be built; ${option}=AUTO builds without")
      endif()
      message(STATUS "Without ${what}: ${need} is not installed (${option}=ON makes that an error)")
      set(${option} OFF PARENT_SCOPE)
      return()
    endif()
  endforeach()
  set(${option} ON PARENT_SCOPE)
  message(STATUS "With ${what}")
endfunction()
