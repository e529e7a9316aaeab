# A fixed dozen of blind cases, made, diagnosed and scored as a person does it: the same verdicts as ever. Where a change of the
# diagnosis is meant to change them, the file of the last run is the new golden one.
#   cmake -DPROGRAM=flappy-blind -DSOURCE=the project -DWORK=a folder to use -P blind_golden_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

run(make --out ${WORK}/bench --set development --cases 2
  --part singles singles_current none parameters withheld pairs)
expect_equal("exit code of make, which says ${err}" "${code}" 0)
run(score ${WORK}/bench --json ${WORK}/bench.json)
expect_equal("exit code of score, which says ${err}" "${code}" 0)
expect_keys(${WORK}/bench.json cases=NUMBER top1_mocap_imu=NUMBER top1_current=NUMBER group_top1=NUMBER top3=NUMBER
  false_alarm=NUMBER withheld_unknown=NUMBER withheld_confidently_wrong=NUMBER ece=NUMBER pairs_f1=NUMBER hover_abstain=NULL)
file(STRINGS ${WORK}/bench/score.csv lines)
set(verdicts "")
foreach(line IN LISTS lines)
  string(REGEX REPLACE "^([^,]*,[^,]*,[^,]*),[^,]*,[^,]*,([^,]*,[^,]*),.*" "\\1,\\2" verdict "${line}")
  string(APPEND verdicts "${verdict}\n")
endforeach()
file(WRITE ${WORK}/blind_verdicts.csv "${verdicts}")
file(READ ${SOURCE}/tests/data/blind_verdicts.csv golden)
expect_equal("verdicts (${WORK}/blind_verdicts.csv)" "${verdicts}" "${golden}")
