# A room is one folder with one library target. Its headers are seen only by targets that name the room in USES:
# each room has an include root of its own (a link farm in the build tree), so a wrong arrow does not compile.
# Headers are included by their path in the repository: #include "rtstdb/gpu/device.hpp".

# What most sources include is compiled once, and up to eight sources as one: a third of the time that they take alone. Not in
# the dev preset: its tree is also for ccache and tools that can not read GCC's precompiled headers, few sources are compiled
# behind a change, and a source that lacks an include is found.
function(hil_precompile name collection)
  if(NOT HIL_COMPILE_TOGETHER)
    return()
  endif()
  if(NOT TARGET ${collection})
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${collection}.cpp CONTENT "" @ONLY)
    add_library(${collection} OBJECT ${PROJECT_BINARY_DIR}/${collection}.cpp)
    target_link_libraries(${collection} PRIVATE hil_compile_options ${ARGN})
    set(headers <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <mutex>
      <optional> <span> <string> <string_view> <thread> <unordered_map> <variant> <vector>)
    if(ARGN)
      list(APPEND headers <gtest/gtest.h>)
    else()
      set_target_properties(${collection} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    endif()
    target_precompile_headers(${collection} PRIVATE ${headers})
  endif()
  target_precompile_headers(${name} REUSE_FROM ${collection})
endfunction()

# Several sources of a target as one, but for those that are named `separate`: they have names of their own in common with others, or
# a test has another one in their place (hil_broken in tests/long).
function(hil_compile_as_one name separate)
  if(HIL_COMPILE_TOGETHER)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    set_source_files_properties(${separate} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()

#   SEPARATE  those of its sources that are not compiled as one with others
function(hil_room name)
  cmake_parse_arguments(ROOM "" "PATH" "SOURCES;SEPARATE;USES;LIBS" ${ARGN})
  set(root ${PROJECT_BINARY_DIR}/rooms/${name})
  get_filename_component(parent ${ROOM_PATH} DIRECTORY)
  file(REMOVE_RECURSE ${root})  # a stale link would be written through
  file(MAKE_DIRECTORY ${root}/${parent})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${ROOM_PATH} ${root}/${ROOM_PATH} SYMBOLIC)
  if(ROOM_SOURCES)
    add_library(${name} STATIC ${ROOM_SOURCES})
    target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${root}>)
    target_link_libraries(${name} PRIVATE hil_compile_options PUBLIC ${ROOM_USES} ${ROOM_LIBS})
    set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    hil_precompile(${name} hil_room_headers)
    hil_compile_as_one(${name} "${ROOM_SEPARATE}")
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE $<BUILD_INTERFACE:${root}>)
    target_link_libraries(${name} INTERFACE ${ROOM_USES} ${ROOM_LIBS})
  endif()
endfunction()

# One test program per folder of tests.
#   LABEL    unit needs nothing but this computer, gpu needs a Vulkan device, system needs the built programs (and what its folder
#            in tests/system names), long takes much time: tools/test --long alone builds and runs it
#   SERIAL   it measures time and runs alone; all long tests do
#   THREADS  it has threads of its own: the thread sanitizer takes it, and no other
#   RUNNER   a program that prepares the machine: the whole program then runs as one test, RUNNER PROGRAM
#   PREFIX   stands before the tests' names where another program has tests of the same; ctest would give both the properties
#            of one of them. Long tests have "Long/".
#   SEPARATE as for rooms
#   TIMEOUT  in seconds, 300 by default; three times as long with sanitizers. It ends a test that hangs, on slow machines too.
# The target hil_tests_<label> builds all programs of a label; tools/test says which of them a sanitizer takes.
function(hil_test name)
  cmake_parse_arguments(TEST "THREADS;SERIAL" "LABEL;TIMEOUT;RUNNER;PREFIX" "SOURCES;SEPARATE;USES;LIBS" ${ARGN})
  if(NOT TEST_LABEL MATCHES "^(unit|gpu|system|long)$")
    message(FATAL_ERROR "hil_test(${name}): LABEL is unit, gpu, system or long, not '${TEST_LABEL}'")
  endif()
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 300)
  endif()
  if(HIL_SANITIZE)
    math(EXPR TEST_TIMEOUT "3 * ${TEST_TIMEOUT}")
  endif()
  if(TEST_LABEL STREQUAL "long")
    string(PREPEND TEST_PREFIX "Long/")
  endif()
  add_executable(${name} ${TEST_SOURCES})
  target_link_libraries(${name} PRIVATE hil_compile_options hil_test_paths ${TEST_USES} ${TEST_LIBS} GTest::gtest_main)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)  # what is tested is fast; the tests compile fast
  hil_precompile(${name} hil_test_headers GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  hil_compile_as_one(${name} "${TEST_SEPARATE}")

  if(HIL_SANITIZE MATCHES "thread" AND NOT TEST_THREADS)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)  # one thread has no races
    return()
  endif()
  if(NOT TARGET hil_tests_${TEST_LABEL})
    add_custom_target(hil_tests_${TEST_LABEL})
  endif()
  add_dependencies(hil_tests_${TEST_LABEL} ${name})
  if(TEST_LABEL STREQUAL "long")
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()

  set(properties LABELS ${TEST_LABEL} TIMEOUT ${TEST_TIMEOUT})
  if(TEST_SERIAL OR TEST_LABEL STREQUAL "long")
    list(APPEND properties RUN_SERIAL ON)
  elseif(TEST_LABEL MATCHES "^(gpu|system)$")
    # lavapipe computes on all processors: two at once fill the pauses of one another, more only wait.
    cmake_host_system_information(RESULT processors QUERY NUMBER_OF_LOGICAL_CORES)
    math(EXPR half "(${processors} + 1) / 2")
    list(APPEND properties PROCESSORS ${half})
  endif()
  if(TEST_RUNNER)
    list(APPEND properties COST 1000)  # the longest begin first
    add_test(NAME ${TEST_LABEL}.${name} COMMAND ${TEST_RUNNER} $<TARGET_FILE:${name}>)
    set_tests_properties(${TEST_LABEL}.${name} PROPERTIES ${properties})
  else()
    gtest_discover_tests(${name} TEST_PREFIX "${TEST_PREFIX}" DISCOVERY_MODE PRE_TEST PROPERTIES ${properties})
  endif()
endfunction()
