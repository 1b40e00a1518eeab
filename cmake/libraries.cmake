# A library is one folder with one target. Only targets that name the library in USES see its headers: each
# library has an include root of its own (a folder of symbolic links in the build tree), so a wrong dependency
# does not compile. Headers are included by their path in the repository: #include "rtstdb/gpu/device.hpp".

# With HIL_COMPILE_TOGETHER, headers that most sources include are precompiled and up to eight sources are
# compiled as one. The dev preset leaves it off: tools that can not read GCC's precompiled headers use its
# tree, a change recompiles few sources, and a source that lacks an include does not compile.
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

# Compiles several sources of a target as one, except those in `separate`: their file-local names collide with
# those of other sources, or a test replaces them (hil_broken in tests/torture).
function(hil_compile_as_one name separate)
  if(HIL_COMPILE_TOGETHER)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    set_source_files_properties(${separate} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()

# Declares the library of folder PATH.
#   SOURCES   its sources; a library without sources has headers alone
#   SEPARATE  sources that are compiled alone
#   USES      libraries of this project whose headers it sees
#   LIBS      libraries of others
function(hil_library name)
  cmake_parse_arguments(LIBRARY "" "PATH" "SOURCES;SEPARATE;USES;LIBS" ${ARGN})
  set(root ${PROJECT_BINARY_DIR}/libraries/${name})
  get_filename_component(parent ${LIBRARY_PATH} DIRECTORY)
  file(REMOVE_RECURSE ${root})  # a stale link would be written through
  file(MAKE_DIRECTORY ${root}/${parent})
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${LIBRARY_PATH} ${root}/${LIBRARY_PATH} SYMBOLIC)
  if(LIBRARY_SOURCES)
    add_library(${name} STATIC ${LIBRARY_SOURCES})
    target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${root}>)
    target_link_libraries(${name} PRIVATE hil_compile_options PUBLIC ${LIBRARY_USES} ${LIBRARY_LIBS})
    set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    hil_precompile(${name} hil_library_headers)
    hil_compile_as_one(${name} "${LIBRARY_SEPARATE}")
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE $<BUILD_INTERFACE:${root}>)
    target_link_libraries(${name} INTERFACE ${LIBRARY_USES} ${LIBRARY_LIBS})
  endif()
endfunction()

# One test program per folder of tests.
#   LABEL    what it needs: unit nothing, gpu a Vulkan device, answers that and time on it, scenario that and the built programs, vcan a real AF_CAN,
#            realtime a machine that keeps time, torture much time (built and run with tools/test --long alone); these two
#            run alone
#   THREADS  it has threads of its own: the thread sanitizer takes it, and no other
#   RUNNER   a program that sets the stage: the whole of it then runs as one test, RUNNER PROGRAM
#   PREFIX   stands before the tests' names where another program has tests of the same; ctest would give both the properties
#            of one of them. Those of torture have "Long/".
#   SEPARATE as for hil_library
#   TIMEOUT  in seconds, 300 unless told; three times as long with sanitizers. It ends what hangs, on slow machines too.
# The target hil_tests_<label> builds all programs of a label; what sanitizers take is told in tools/test.
function(hil_test name)
  cmake_parse_arguments(TEST "THREADS" "LABEL;TIMEOUT;RUNNER;PREFIX" "SOURCES;SEPARATE;USES;LIBS" ${ARGN})
  if(NOT TEST_LABEL MATCHES "^(unit|gpu|answers|scenario|vcan|realtime|torture)$")
    message(FATAL_ERROR "hil_test(${name}): LABEL is unit, gpu, answers, scenario, vcan, realtime or torture, not '${TEST_LABEL}'")
  endif()
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 300)
  endif()
  if(HIL_SANITIZE)
    math(EXPR TEST_TIMEOUT "3 * ${TEST_TIMEOUT}")
  endif()
  if(TEST_LABEL STREQUAL "torture")
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
  if(TEST_LABEL STREQUAL "torture")
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()

  set(properties LABELS ${TEST_LABEL} TIMEOUT ${TEST_TIMEOUT})
  if(TEST_LABEL MATCHES "^(realtime|torture)$")
    list(APPEND properties RUN_SERIAL ON)
  elseif(TEST_LABEL MATCHES "^(gpu|answers|scenario)$")
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
