# flappy-server as a person meets it: what it prints, leaves and refuses.
#   cmake -DPROGRAM=flappy-server -DSOURCE=the project -DWORK=a folder to use -P server_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)
find_program(TIMEOUT timeout REQUIRED)
set(local ${SOURCE}/configs/server/local.toml --set "jobs.output=\"${WORK}/jobs\"")

# ---- it works until Ctrl-C, and listens where it is told

execute_process(COMMAND bash -c "TIMEFORMAT='%U %S'; time \"$@\"" bash ${TIMEOUT} --foreground --preserve-status -s INT 1.5 ${PROGRAM} ${local} --http 127.0.0.1:0
  OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("exit code" "${code}" 0)
expect_match("stderr, but for seconds of processor time, nearly none" "${err}" "^0\\.[01][0-9]* 0\\.[01][0-9]*\n$")
expect_match("stdout" "${out}" "^dashboard: http://127.0.0.1:[0-9]+/\n${WORK}/jobs: 0 jobs to go on with\nstopped; go on: the same command\n$")
execute_process(COMMAND ${TIMEOUT} --foreground --preserve-status -s TERM 1 ${PROGRAM} ${local} OUTPUT_VARIABLE out RESULT_VARIABLE code)
expect_equal("exit code" "${code}" 0)
expect_equal("stdout without --http" "${out}" "${WORK}/jobs: 0 jobs to go on with\nstopped; go on: the same command\n")
foreach(name IN ITEMS queue.sqlite log.txt)
  if(NOT EXISTS ${WORK}/jobs/${name})
    message(SEND_ERROR "${WORK}/jobs lacks ${name}")
  endif()
endforeach()

# ---- what is refused

expect_refused("flappy-server: config is required; see flappy-server --help")
expect_refused("${WORK}/none.toml: cannot be read: No such file or directory" ${WORK}/none.toml)
expect_refused("http.listen: \"8080\" is no address; accepted: ADDRESS:PORT, as 127.0.0.1:8080" ${local} --http 8080)
expect_refused("http.listen: \"192.0.2.1:80\" cannot be listened on; accepted: a free port of an address of this machine" ${local} --http 192.0.2.1:80)
expect_refused("--set jobs.at_once=0: jobs.at_once: 0 is out of range; accepted: an integer from 1 to 1000" ${local} --set jobs.at_once=0)
file(TOUCH ${WORK}/file)
expect_refused("${WORK}/file: cannot be written: Not a directory" ${SOURCE}/configs/server/local.toml --set "jobs.output=\"${WORK}/file\"")
