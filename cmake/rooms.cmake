# A room is one folder with one library target. Its headers are seen only by targets that name the room in USES:
# each room has an include root of its own (a link farm in the build tree), so a wrong arrow does not compile.
# Headers are included by their path in the repository: #include "rtstdb/gpu/device.hpp".

function(hil_room name)
  cmake_parse_arguments(ROOM "" "PATH" "SOURCES;USES;LIBS" ${ARGN})
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
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE $<BUILD_INTERFACE:${root}>)
    target_link_libraries(${name} INTERFACE ${ROOM_USES} ${ROOM_LIBS})
  endif()
endfunction()

# One test program per folder of tests. LABEL says which machine it needs: unit, gpu, realtime, vcan, torture.
function(hil_test name)
  cmake_parse_arguments(TEST "" "LABEL;TIMEOUT" "SOURCES;USES;LIBS" ${ARGN})
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 120)
  endif()
  add_executable(${name} ${TEST_SOURCES})
  target_link_libraries(${name} PRIVATE hil_compile_options ${TEST_USES} ${TEST_LIBS} GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  target_compile_definitions(${name} PRIVATE
    HIL_SOURCE_DIR="${PROJECT_SOURCE_DIR}" HIL_BINARY_DIR="${PROJECT_BINARY_DIR}")
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST
    PROPERTIES LABELS "${TEST_LABEL}" TIMEOUT ${TEST_TIMEOUT})
endfunction()
