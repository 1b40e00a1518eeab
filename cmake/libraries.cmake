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
    set(headers <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <filesystem> <functional> <map>
      <memory> <mutex> <optional> <span> <string> <string_view> <thread> <unordered_map> <variant> <vector>
      <glm/ext/quaternion_double.hpp> <glm/ext/vector_double3.hpp> <glm/ext/vector_float3.hpp>)
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
# those of other sources.
function(hil_compile_as_one name separate)
  if(HIL_COMPILE_TOGETHER)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    set_source_files_properties(${separate} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()

# For what never runs in the tick of a run: compiles in little more than half of the time.
function(hil_optimize_little name)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# Sets `result` to the sources of a table of kinds: MACRO(name) in `table`, a path relative to this folder,
# stands for the source name.cpp beside it.
function(hil_sources_of_table result table macro)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${table})
  file(STRINGS ${table} lines REGEX "^${macro}\\(")
  get_filename_component(folder ${table} DIRECTORY)
  set(sources "")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE "^${macro}\\(([a-z0-9_]+)\\)$" "\\1" name ${line})
    list(APPEND sources ${folder}/${name}.cpp)
  endforeach()
  set(${result} ${sources} PARENT_SCOPE)
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

# Declares the public headers of a folder PATH below an include folder, as in runtime/include/hil/world, as a
# library without sources: <hil/world/...>. Folders inside it are other libraries.
function(hil_public_headers name)
  cmake_parse_arguments(LIBRARY "" "PATH" "USES" ${ARGN})
  string(REGEX REPLACE "^.*/include/" "" folder ${LIBRARY_PATH})
  set(root ${PROJECT_BINARY_DIR}/libraries/${name})
  file(REMOVE_RECURSE ${root})
  file(MAKE_DIRECTORY ${root}/${folder})
  file(GLOB headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${LIBRARY_PATH}/*.hpp)
  foreach(header IN LISTS headers)
    get_filename_component(file ${header} NAME)
    file(CREATE_LINK ${header} ${root}/${folder}/${file} SYMBOLIC)
  endforeach()
  add_library(${name} INTERFACE)
  target_include_directories(${name} INTERFACE $<BUILD_INTERFACE:${root}>)
  target_link_libraries(${name} INTERFACE ${LIBRARY_USES})
endfunction()

# Declares a plug-in NAME.so in the folder `plugins` of the build, which hil searches. In another FOLDER of
# the build it is for tests and is not installed.
function(hil_plugin name)
  cmake_parse_arguments(PLUGIN "" "FOLDER" "SOURCES" ${ARGN})
  add_library(${name} MODULE ${PLUGIN_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE hil_compile_options hil::module)
  if(PLUGIN_FOLDER)
    set(folder ${PLUGIN_FOLDER})
  else()
    set(folder plugins)
    install(TARGETS ${name} LIBRARY DESTINATION lib/hil/plugins COMPONENT hil)
  endif()
  set_target_properties(${name} PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/${folder})
endfunction()

# One test program per folder of tests. ctest runs each of its suites as one test.
#   LABEL    unit needs nothing but this computer, gpu needs a Vulkan device, system needs the built programs
#            (and what its folder in tests/system names), long takes much time: tools/test --long alone builds
#            and runs it
#   LONG     its tests have a long form too (tests/support/rounds.hpp): tools/test --long runs them once more
#            under the label long and names that begin with Long/, with HIL_TESTS_LONG in the environment and
#            this timeout in seconds; LONG_FILTER chooses suites of them, as --gtest_filter does
#   SERIAL   it measures time and runs alone; all long tests do
#   TIMING   suites whose subject is real time, which other load can disturb: they have the label timing
#            besides, and tools/test lets them pass when they are repeated alone. So has a test with a RUNNER
#   THREADS  it has threads of its own: the thread sanitizer takes it, and no other
#   RUNNER   a program that prepares the machine: the whole program then runs as one test, RUNNER PROGRAM
#   SEPARATE as for hil_library
#   TIMEOUT  in seconds for a suite, 600 by default; three times as long with sanitizers. It ends a test that
#            hangs, on slow machines too.
# The target hil_tests_<label> builds all programs of a label; tools/test says which a sanitizer takes.
function(hil_test name)
  cmake_parse_arguments(TEST "THREADS;SERIAL" "LABEL;TIMEOUT;LONG;LONG_FILTER;RUNNER"
    "SOURCES;SEPARATE;TIMING;USES;LIBS" ${ARGN})
  if(NOT TEST_LABEL MATCHES "^(unit|gpu|system|long)$")
    message(FATAL_ERROR "hil_test(${name}): LABEL is unit, gpu, system or long, not '${TEST_LABEL}'")
  endif()
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 600)
  endif()
  add_executable(${name} ${TEST_SOURCES})
  target_link_libraries(${name} PRIVATE hil_compile_options hil_test_paths ${TEST_USES} ${TEST_LIBS}
    GTest::gtest_main)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)  # the tests compile faster
  hil_precompile(${name} hil_test_headers GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  hil_compile_as_one(${name} "${TEST_SEPARATE}")

  if(HIL_SANITIZE MATCHES "thread" AND NOT TEST_THREADS)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)  # one thread has no races
    return()
  endif()
  if(TEST_LABEL STREQUAL "long")
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()

  if(TEST_RUNNER)
    hil_test_properties(properties ${TEST_LABEL} ${TEST_TIMEOUT} "${TEST_SERIAL}")
    list(APPEND properties COST 1000)  # the longest begin first
    add_test(NAME ${TEST_LABEL}.${name} COMMAND ${TEST_RUNNER} $<TARGET_FILE:${name}>)
    set_tests_properties(${TEST_LABEL}.${name} PROPERTIES ${properties})
    set_tests_properties(${TEST_LABEL}.${name} PROPERTIES LABELS "${TEST_LABEL};timing")
    hil_add_to_label(${name} ${TEST_LABEL})
    return()
  endif()
  hil_discover(${name} ${TEST_LABEL} ${TEST_TIMEOUT} "${TEST_SERIAL}" "" "${TEST_TIMING}")
  if(TEST_LONG)
    hil_discover(${name} long ${TEST_LONG} ON "${TEST_LONG_FILTER}" "${TEST_TIMING}")
  endif()
endfunction()

# The properties of a program's tests, for set_tests_properties.
function(hil_test_properties result label timeout serial)
  if(HIL_SANITIZE)
    math(EXPR timeout "3 * ${timeout}")
  endif()
  set(properties LABELS ${label} TIMEOUT ${timeout})
  if(serial OR label STREQUAL "long")
    list(APPEND properties RUN_SERIAL ON)
  elseif(label MATCHES "^(gpu|system)$")
    # lavapipe computes on all processors: two at once fill the pauses of one another, more only wait.
    cmake_host_system_information(RESULT processors QUERY NUMBER_OF_LOGICAL_CORES)
    math(EXPR half "(${processors} + 1) / 2")
    list(APPEND properties PROCESSORS ${half})
  endif()
  set(${result} ${properties} PARENT_SCOPE)
endfunction()

function(hil_add_to_label name label)
  if(NOT TARGET hil_tests_${label})
    add_custom_target(hil_tests_${label})
  endif()
  add_dependencies(hil_tests_${label} ${name})
endfunction()

# The suites of a program that `filter` chooses, each as one test under a label.
function(hil_discover name label timeout serial filter timing)
  hil_test_properties(properties ${label} ${timeout} "${serial}")
  set(prefix "")
  if(label STREQUAL "long")
    set(prefix Long/)
    list(APPEND properties ENVIRONMENT HIL_TESTS_LONG=1)
  endif()
  if(NOT filter)
    set(filter *)
  endif()
  list(JOIN properties "]==] [==[" properties)
  set(suites ${CMAKE_CURRENT_BINARY_DIR}/${name}_${label}.cmake)
  file(GENERATE OUTPUT ${suites} CONTENT
"if(EXISTS \"$<TARGET_FILE:${name}>\")
  include(\"${PROJECT_SOURCE_DIR}/cmake/test_suites.cmake\")
  hil_add_suites([==[$<TARGET_FILE:${name}>]==] \"${prefix}\" [==[${filter}]==]
    [==[${PROJECT_BINARY_DIR}/results]==] ${label} [==[${timing}]==]
    [==[${properties}]==])
else()
  add_test(${name}_NOT_BUILT ${name}_NOT_BUILT)
endif()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${suites})
  hil_add_to_label(${name} ${label})
endfunction()
