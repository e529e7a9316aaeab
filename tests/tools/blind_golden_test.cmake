# A few blind cases, CASES of each of PARTS, made, diagnosed and scored as a person does it: the verdicts that GOLDEN has. Where a change of the
# diagnosis is meant to change them, the file of the last run is the new golden one.
#   cmake -DPROGRAM=flappy-blind -DSOURCE=the project -DWORK=a folder to use -P blind_golden_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

separate_arguments(PARTS)
run(make --out ${WORK}/bench --set development --cases ${CASES} --part ${PARTS})
expect_equal("exit code of make, which says ${err}" "${code}" 0)
run(score ${WORK}/bench --json ${WORK}/bench.json)
expect_equal("exit code of score, which says ${err}" "${code}" 0)
expect_keys(${WORK}/bench.json cases=NUMBER top1_mocap_imu=NUMBER group_top1=NUMBER top3=NUMBER
  unknown=NUMBER unknown_wrong=NUMBER ece=NUMBER hover_abstain=NULL)
file(STRINGS ${WORK}/bench/score.csv lines)
set(verdicts "")
foreach(line IN LISTS lines)
  string(REGEX REPLACE "^([^,]*,[^,]*,[^,]*),[^,]*,([^,]*,[^,]*),.*" "\\1,\\2" verdict "${line}")
  string(APPEND verdicts "${verdict}\n")
endforeach()
file(WRITE ${WORK}/${GOLDEN} "${verdicts}")
file(READ ${SOURCE}/tests/data/${GOLDEN} golden)
expect_equal("verdicts (${WORK}/${GOLDEN})" "${verdicts}" "${golden}")
