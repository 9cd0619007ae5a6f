# Writes FILE, which ctest reads: one test for each suite of the Google Test program EXECUTABLE. What a process loads and starts (250
# libraries, the device) is paid once a suite, not once a test; a crash is still one failure, and the output of a failed suite names its test.
#
# PROPERTIES are given to every suite; COSTS are "SUITE=SECONDS" of those that ctest is to begin with.
#
# DISABLED_ tests are what a test runs in a child process of its own; they are no tests by themselves.
execute_process(COMMAND ${EXECUTABLE} --gtest_list_tests --gtest_filter=-*DISABLED_* OUTPUT_VARIABLE listing COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[A-Za-z][A-Za-z0-9_/]*\\." suites "${listing}")
set(text "")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "[\n.]" "" suite "${suite}")
  string(APPEND text "add_test([=[${PREFIX}.${suite}]=] ${EXECUTABLE} --gtest_filter=${suite}.*-*DISABLED_*)\n"
    "set_tests_properties([=[${PREFIX}.${suite}]=] PROPERTIES TIMEOUT 600 WORKING_DIRECTORY ${FOLDER} ${PROPERTIES})\n")
  foreach(cost IN LISTS COSTS)
    if(cost MATCHES "^${suite}=(.*)$")
      string(APPEND text "set_tests_properties([=[${PREFIX}.${suite}]=] PROPERTIES COST ${CMAKE_MATCH_1})\n")
    endif()
  endforeach()
endforeach()
file(WRITE ${FILE} "${text}")
