# flappy-tune as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-tune -DSOURCE=the project -DWORK=a folder to use -P tune_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

# Writes ${WORK}/NAME.toml: which gains, on how many flights.
function(write_config name vary trials)
  set(text "schema = 1\nvary = [${vary}]\nduration_s = 0.6\nsettle_s = 0.3\nseed = 5\npopulation = 6\ngenerations = 2\n")
  foreach(count IN LISTS trials)
    string(APPEND text "[[trial]]\nfly = \"${SOURCE}/configs/fly/hover.toml\"\ncount = ${count}\nweight = 1.0\n")
  endforeach()
  file(WRITE ${WORK}/${name}.toml "${text}")
endfunction()

# ---- two generations: never worse than the start, the same twice over, and a file that flies

write_config(good "\"attitude.pitch.p\", \"low_pass.velocity_hz\"" "2;3")
foreach(i IN ITEMS 1 2)
  run(${WORK}/good.toml ${WORK}/tuned${i}.toml --json ${WORK}/tuned${i}.json)
  expect_equal("stderr" "${err}" "")
  expect_equal("exit code" "${code}" 0)
  file(READ ${WORK}/tuned${i}.toml tuned${i})
endforeach()
expect_equal("a second run" "${tuned2}" "${tuned1}")
expect_match("stdout" "${out}" "^start: cost [0-9.]+\ngeneration 1 of 2: cost [0-9.]+, [0-9]+ s\n")
expect_match("the tuned file" "${tuned1}" "\nattitude.pitch.p = [0-9.]+\n")
expect_keys(${WORK}/tuned1.json start_cost=NUMBER cost=NUMBER generations=NUMBER)
file(READ ${WORK}/tuned1.json json)
string(JSON before GET "${json}" start_cost)
string(JSON after GET "${json}" cost)
if(after GREATER before)
  message(SEND_ERROR "cost rose from ${before} to ${after}")
endif()
file(READ ${SOURCE}/configs/fly/hover.toml fly)
string(REPLACE "../controllers/pid.toml" "${WORK}/tuned1.toml" fly "${fly}")
string(REPLACE "\"../" "\"${SOURCE}/configs/" fly "${fly}")
file(WRITE ${WORK}/fly.toml "${fly}")
write_config(again "\"attitude.pitch.p\"" "1")
file(READ ${WORK}/again.toml again)
string(REPLACE "${SOURCE}/configs/fly/hover.toml" "${WORK}/fly.toml" again "${again}")
file(WRITE ${WORK}/again.toml "${again}")
run(${WORK}/again.toml ${WORK}/again_tuned.toml)
expect_equal("tuning what was tuned" "${code}" 0)

# ---- refusals

write_config(unknown "\"attitude.pitsch.p\"" "1")
expect_refused("${WORK}/unknown.toml:2:8: vary: no gain \"attitude.pitsch.p\"; accepted: paths of the controller's file; did you mean \"attitude.pitch.p\"?"
  ${WORK}/unknown.toml ${WORK}/out.toml)
write_config(empty "\"attitude.pitch.p\"" "")
expect_refused("${WORK}/empty.toml: trial: is missing; accepted: at least one [[trial]]" ${WORK}/empty.toml ${WORK}/out.toml)
expect_refused("${WORK}/gone.toml: cannot be read: No such file or directory" ${WORK}/gone.toml ${WORK}/out.toml)
if(EXISTS ${WORK}/out.toml)
  message(SEND_ERROR "a refused run left a controller")
endif()
