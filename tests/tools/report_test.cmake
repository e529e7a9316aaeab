# flappy-report as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-report -DSOURCE=the project -DWORK=a folder to use -DFLY=flappy-fly -P report_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)
set(data ${SOURCE}/tests/data/report)

# ---- a flight, as flappy-fly leaves it, beside a diagnosis

execute_process(COMMAND ${FLY} ${SOURCE}/configs/fly/hover.toml --set flight.duration_s=0.6 --set flight.settle_s=0.2 --log ${WORK}/hover OUTPUT_VARIABLE out RESULT_VARIABLE code)
expect_equal("exit code of flappy-fly" "${code}" 0)
expect_match("its last line" "${out}" "shown by: flappy-report ${WORK}/hover --out report.html\n$")
run(${WORK}/hover ${data}/diagnosis --goal 0,0,0.4 --out ${WORK}/report.html --svg ${WORK}/svg --json ${WORK}/report.json)
expect_equal("stderr" "${err}" "")
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^${WORK}/report.html: 1.[0-9][0-9] MB, opens in any browser\n${WORK}/svg: [0-9]+ figures\n$")
expect_keys(${WORK}/report.json out=STRING bytes=NUMBER commit=STRING)
file(READ ${WORK}/report.json json)
string(JSON first GET "${json}" sections 0 kind)
string(JSON second GET "${json}" sections 1 kind)
expect_equal("sections" "${first} ${second}" "flight diagnosis")
foreach(name IN ITEMS position attitude inputs probabilities loss channels regimes)
  if(NOT EXISTS ${WORK}/svg/${name}.svg)
    message(SEND_ERROR "no ${name}.svg")
  endif()
endforeach()
run(${WORK}/hover ${data}/diagnosis --goal 0,0,0.4 --out ${WORK}/again.html)
file(SHA256 ${WORK}/report.html one)
file(SHA256 ${WORK}/again.html two)
expect_equal("the page of the same results" "${two}" "${one}")

# ---- what is refused

set(accepted "; accepted: a flight log or a folder of them, a run folder or a folder of runs of flappy-train, JSON of flappy-eval, flappy-gap diagnose or plan (or its folder) or flappy-identify forces, a folder or score.csv of flappy-blind score, figures of flappy-bench (.jsonl), the folder or design.json of flappy-design")
expect_refused("flappy-report: path is required; see flappy-report --help")
expect_refused("${WORK}/none: there is no such file or folder" ${WORK}/none)
file(MAKE_DIRECTORY ${WORK}/empty)
expect_refused("${WORK}/empty: is no folder of results${accepted}" ${WORK}/empty)
file(WRITE ${WORK}/broken.json "{")
expect_refused("${WORK}/broken.json:1:1: is no JSON; accepted: results of a program, as --json wrote them" ${WORK}/broken.json)
file(WRITE ${WORK}/other.json "{}")
expect_refused("${WORK}/other.json: is JSON of something else${accepted}" ${WORK}/other.json)
expect_refused("--goal: has 2 numbers; accepted: X,Y,Z in m" ${WORK}/hover --goal 1,2)
expect_refused("${WORK}/none/report.html: cannot be written: No such file or directory" ${WORK}/hover --out ${WORK}/none/report.html)
file(STRINGS ${WORK}/hover/mocap.csv header LIMIT_COUNT 1)
file(WRITE ${WORK}/hover/mocap.csv "${header}\n")
run(${WORK}/hover --out ${WORK}/report.html)
expect_equal("exit code of an empty flight" "${code}" 2)
expect_match("an empty flight" "${err}" "^${WORK}/hover/mocap.csv: [^\n]*\n$")

# ---- no output replaces what is read

expect_kept(${WORK}/hover/mocap.csv --json ${WORK}/hover --out ${WORK}/kept.html)
expect_kept(${WORK}/hover/mocap.csv --out ${WORK}/hover)
