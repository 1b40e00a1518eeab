# Read by ctest: adds one test, PROGRAM.SUITE, for each suite of a GoogleTest program. The cases of a suite
# run in one process, which shares what is expensive to open; it leaves their results in RESULTS/<test>.json,
# which tools/tally counts.
function(hil_add_suites program prefix filter results)
  execute_process(COMMAND ${program} --gtest_list_tests "--gtest_filter=${filter}"
    OUTPUT_VARIABLE listed RESULT_VARIABLE failed TIMEOUT 60)
  if(failed)
    add_test("${prefix}${program}" "${program}" --gtest_list_tests)  # fails, and says why
    set_tests_properties("${prefix}${program}" PROPERTIES ${ARGN})
    return()
  endif()
  string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." suites "${listed}")
  get_filename_component(name "${program}" NAME)
  if(NOT suites)
    add_test("${prefix}${name} has no suite ${filter}" false)
    set_tests_properties("${prefix}${name} has no suite ${filter}" PROPERTIES ${ARGN})
    return()
  endif()
  foreach(suite IN LISTS suites)
    string(REGEX REPLACE "[\n.]" "" suite "${suite}")
    set(test "${prefix}${name}.${suite}")
    string(REPLACE "/" "_" file "${test}")
    file(WRITE "${results}/${file}.suite" "")
    add_test("${test}" "${program}" "--gtest_filter=${suite}.*" "--gtest_output=json:${results}/${file}.json")
    set_tests_properties("${test}" PROPERTIES ${ARGN})
  endforeach()
endfunction()
