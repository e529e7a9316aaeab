# A robot that is made, diagnosed, trained for and flown, as a person does it, with training that is far too short.
#   cmake -DPROGRAM=flappy-blind -DTRAIN=flappy-train -DSOURCE=the project -DWORK=a folder to use -P blind_loop_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

set(small --set collect.flappers=48 --set collect.vehicles=16 --set networks.critic=[32,32] --set learn.replay=4000
  --set learn.batch=64 --set evaluate.vehicles=32 --set learn.updates=30 --set evaluate.every=30 --set checkpoint.every=30)
execute_process(COMMAND ${TRAIN} ${SOURCE}/configs/train/escape.toml ${small} --out ${WORK}/run OUTPUT_QUIET RESULT_VARIABLE code)
expect_equal("exit code of flappy-train" "${code}" 0)
expect_refused("${WORK}/gone/manifest.json: cannot be read: No such file or directory" loop ${WORK}/gone --run ${WORK}/run --out ${WORK}/loop)
run(make --family c --out ${WORK}/single --set development --part singles --cases 1)
expect_equal("exit code of make, which says ${err}" "${code}" 0)
expect_refused("${WORK}/single/predictions.sha256: cannot be read: No such file or directory"
  loop ${WORK}/single --run ${WORK}/run --out ${WORK}/loop)
run(score ${WORK}/single --discrepancy ${SOURCE}/configs/lab/discrepancy/without_c.toml)
expect_equal("exit code of score, which says ${err}" "${code}" 0)
set(loop loop ${WORK}/single --run ${WORK}/run --out ${WORK}/single_loop --escapes 2 ${small})
run(${loop} --json ${WORK}/loop.json)
expect_equal("exit code of loop, which says ${err}" "${code}" 0)
expect_match("loop" "${out}" "\n\\| all \\| 1 \\| [01].000 \\([0-9.]+ to [0-9.]+\\) \\| [01] \\| [01] \\| [01].[05]00 \\|.*\\| c \\| 1 \\|")
expect_keys(${WORK}/loop.json all.robots=NUMBER all.better=NUMBER c.corrected=NUMBER)
file(STRINGS ${WORK}/single_loop/loop.csv lines)
list(GET lines 1 line)
expect_match("line of a robot" "${line}" "^c,1,singles,[a-z_]+,[a-z]+,[a-z_+]*,2,[012],[012],[012],300")

# What was found stays: the same command trains and flies nothing again.
file(SHA256 ${WORK}/single_loop/c_0001/corrected/summary.json first)
run(${loop})
file(SHA256 ${WORK}/single_loop/c_0001/corrected/summary.json second)
expect_equal("training of before" "${second}" "${first}")
# With other escapes it flies again.
run(loop ${WORK}/single --run ${WORK}/run --out ${WORK}/single_loop --escapes 1 ${small})
file(STRINGS ${WORK}/single_loop/loop.csv lines)
list(GET lines 1 line)
expect_match("line of a robot" "${line}" "^c,1,singles,[a-z_]+,[a-z]+,[a-z_+]*,1,[01],[01],[01],300")
# Robots are chosen by what their effect costs, and what was flown to choose them stays.
run(${loop} --costly ${WORK}/run)
expect_equal("exit code of loop --costly, which says ${err}" "${code}" 0)
expect_match("robots that are left out" "${out}" "as often as without their effect: (none|c 1)\n")
expect_keys(${WORK}/single_loop/c_0001/as_shipped.json of=STRING escapes=NUMBER succeeded=NUMBER)
# Policies of other runs fly as they are.
run(${loop} --also ${WORK}/run/)
expect_equal("exit code of loop --also, which says ${err}" "${code}" 0)
expect_match("column of another policy" "${out}" "corrected vehicle \\| run \\|\n.*\\| c \\| 1 \\|.* [01]\\.[05]00 \\|\n")
expect_refused("loop: no policy to fly; accepted: --run, --also or both" loop ${WORK}/single --out ${WORK}/flown)
# Without a run to train on, no diagnosis is read, and effects stay sealed.
file(RENAME ${WORK}/single/predictions ${WORK}/predictions)
run(loop ${WORK}/single --also ${WORK}/run --out ${WORK}/flown --escapes 2)
file(RENAME ${WORK}/predictions ${WORK}/single/predictions)
expect_equal("exit code of loop without --run, which says ${err}" "${code}" 0)
expect_match("table of policies alone" "${out}" "\\| family \\| robots \\| run \\|\n.*\\| c \\| 1 \\| [01]\\.[05]00 \\|\n")
file(STRINGS ${WORK}/flown/loop.csv lines)
list(GET lines 1 line)
expect_match("line of a robot" "${line}" "^c,1,singles,2,[012],300")
expect_refused("--also ${WORK}/run: another policy is called run; accepted: run folders of different names"
  ${loop} --also ${WORK}/run ${WORK}/run)
file(APPEND ${WORK}/single/predictions/0001.json " ")
expect_refused("${WORK}/single/predictions/0001.json: has changed; accepted: what was sealed" ${loop})
