# What flappy-server installs as, where the tools are at hand that read it.
#   cmake -DPROGRAM=flappy-server -DSOURCE=the project -DWORK=a folder to use -P packaging_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

find_program(SYSTEMD systemd-analyze)
if(NOT SYSTEMD)
  message("skipped: there is no systemd-analyze")
  return()
endif()

# the unit, with the program where it is
file(READ ${SOURCE}/packaging/flappy-server.service unit)
string(REPLACE "/usr/bin/flappy-server" "${PROGRAM}" unit "${unit}")
file(WRITE ${WORK}/flappy-server.service "${unit}")
execute_process(COMMAND ${SYSTEMD} verify --man=no ${WORK}/flappy-server.service OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("systemd-analyze verify" "${code}: ${out}${err}" "0: ")
execute_process(COMMAND ${SYSTEMD} security --offline=yes --threshold=25 ${WORK}/flappy-server.service OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("exposure of at most 2.5: ${out}${err}" "${code}" 0)

# what the container installs exists, as long as apt knows packages at all
find_program(APT apt-cache)
if(APT)
  file(READ ${SOURCE}/packaging/Containerfile text)
  string(REGEX MATCH "--no-install-recommends (tini [a-z0-9. -]*)" found "${text}")
  string(STRIP "${CMAKE_MATCH_1}" packages)
  string(REPLACE " " ";" packages "${packages}")
  execute_process(COMMAND ${APT} show --no-all-versions ${packages} OUTPUT_VARIABLE out ERROR_QUIET)
  string(REGEX MATCHALL "Package: [^\n]*" shown "${out}")
  list(LENGTH packages expected)
  list(LENGTH shown actual)
  if(NOT actual EQUAL 0)
    expect_equal("packages of the container: ${shown}" "${actual}" "${expected}")
  endif()
endif()
