# flappy-blind as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-blind -DSOURCE=the project -DWORK=a folder to use -P blind_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

set(vehicle ${SOURCE}/configs/vehicles/hummingbird_identified.toml)
set(fly fly --vehicle ${vehicle} --seed 1 --programme hover)

run(effects)
expect_equal("exit code of effects" "${code}" 0)
expect_match("effects" "${out}" "^ground_effect\n.*\nmocap_delay\noutside_")

run(${fly} --randomise ${SOURCE}/configs/randomisation/published.toml --effect wind=0.5 --power --out ${WORK}/a
  --json ${WORK}/a.json)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "flight_1: 10 s, up to [0-9]+ mm off, tilted up to [0-9]+ deg\n.*flight_3: .*\nshown by: flappy-report ${WORK}/a --out report.html\n$")
expect_keys(${WORK}/a.json seed=NUMBER draw=NUMBER crashes=ARRAY flights=ARRAY)
foreach(k RANGE 1 3)
  foreach(file flight.toml command.csv mocap.csv imu.csv power.csv truth.csv)
    if(NOT EXISTS ${WORK}/a/flight_${k}/${file})
      message(SEND_ERROR "no flight_${k}/${file}")
    endif()
  endforeach()
endforeach()
if(EXISTS ${WORK}/a/flight_1/wings.csv)
  message(SEND_ERROR "wings.csv, not asked for")
endif()

# The same seed, the same bytes; without truth, there is none.
run(${fly} --randomise ${SOURCE}/configs/randomisation/published.toml --effect wind=0.5 --power --no-truth --out ${WORK}/b)
foreach(file flight.toml command.csv mocap.csv imu.csv power.csv)
  file(SHA256 ${WORK}/a/flight_2/${file} first)
  file(SHA256 ${WORK}/b/flight_2/${file} second)
  expect_equal("flight_2/${file}" "${second}" "${first}")
endforeach()
if(EXISTS ${WORK}/b/flight_1/truth.csv)
  message(SEND_ERROR "truth.csv in spite of --no-truth")
endif()

# A robot of a family, A by the interface that all have; what there is not.
run(effects --family a)
expect_match("effects of a family" "${out}" "^ground_effect +an image source.*\noutside_mocap_lens +[^\n]+\n$")
run(fly --family a --hover --own-parameters --conventions --seed 1 --out ${WORK}/family --json ${WORK}/family.json)
expect_equal("exit code of fly --family: ${err}" "${code}" 0)
expect_keys(${WORK}/family.json family=STRING seed=NUMBER draw=NUMBER crashes=ARRAY flights=ARRAY)
expect_refused("--family d: no such family; accepted: a, b or c" fly --family d --seed 1 --out ${WORK}/c)
expect_refused("--randomise: draws robots without --family; accepted: --own-parameters"
  fly --family a --randomise x.toml --seed 1 --out ${WORK}/c)
expect_refused("flappy-blind: --conventions requires --family; see flappy-blind --help" fly --conventions --seed 1 --out ${WORK}/c)
expect_refused("flappy-blind: --calm-reference requires --reference; see flappy-blind --help" fly --family a --calm-reference --seed 1 --out ${WORK}/c)
expect_refused("--reference ${WORK}/c: is also --out; accepted: two folders" fly --family a --reference ${WORK}/c --seed 1 --out ${WORK}/c)

expect_refused("--effect wnd: no such effect; accepted: what `flappy-blind effects` lists; did you mean \"wind\"?"
  ${fly} --effect wnd=1 --out ${WORK}/c)
expect_refused("--effect wind: no magnitude; accepted: ID=MAGNITUDE, as ground_effect=1" ${fly} --effect wind --out ${WORK}/c)
file(GLOB left ${WORK}/c*)
expect_equal("files left by a refusal" "${left}" "")
file(WRITE ${WORK}/note.txt "")
expect_refused("${WORK}/note.txt: cannot be written: Not a directory" ${fly} --out ${WORK}/note.txt)

# Escapes under a policy that adds nothing: nobody arrives, and whoever left the bounds is counted.
file(WRITE ${WORK}/policy.h "#define FLAPPY_POLICY_OBS 29\n#define FLAPPY_POLICY_ACT 4\n"
  "static void flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT]) {\n"
  "  action[0] = action[1] = action[2] = action[3] = 0 * obs[0];\n}\n"
  "static int flappy_policy_selftest(void) { return 0; }\n")
set(escape escape --vehicle ${vehicle} --seed 1 --count 2)
run(${escape} --policy ${WORK}/policy.h --out ${WORK}/escapes --json ${WORK}/escapes.json)
expect_equal("exit code of escape: ${err}" "${code}" 0)
expect_match("escape" "${out}" "^2 escapes: success 0.0 % \\(0.0 to [0-9.]+\\), captured the goal 0.0 %\n  out of bounds: [0-9]; crashed: [0-9]\n$")
expect_keys(${WORK}/escapes.json escapes=NUMBER success_rate=NUMBER success_low=NUMBER success_high=NUMBER captured_rate=NUMBER
  time_to_capture_median_s=NULL out_of_bounds=NUMBER crashed=NUMBER)
if(NOT EXISTS ${WORK}/escapes/escape_2/imu.csv)
  message(SEND_ERROR "no escape_2/imu.csv")
endif()
expect_refused("${WORK}/note.txt: is no policy; accepted: an actor (.json), TorchScript (.pt), ONNX (.onnx) or a C header (.h)"
  ${escape} --policy ${WORK}/note.txt)
expect_refused("${SOURCE}/configs/fly/hover.toml: is nothing that this robot can fly; accepted: a PID at 500 Hz, a task with a goal that stands still and a success"
  ${escape} --policy ${WORK}/policy.h --config ${SOURCE}/configs/fly/hover.toml)


# Before hours of work, not after.
expect_refused("--family d: no such family; accepted: a, b or c" make --family d --set development --out ${WORK}/c)
expect_refused("flappy-blind: --part: nonsense not in {singles,singles_current,redeclared,none,parameters,own_parameters,conventions,withheld,outside,pairs,hover,singles_bench,own_parameters_bench,changed,changed_short_reference,changed_short_test,unchanged,changed_calm,unchanged_calm,changed_withheld,changed_outside,changed_pairs}; see flappy-blind --help"
  make --set development --part nonsense --out ${WORK}/c)
expect_refused("--only 7: no such case; accepted: 1 to 1"
  make --set development --part none --cases 1 --only 7 --out ${WORK}/c)
expect_refused("--skip 1000: leaves no case; accepted: less than a part has"
  make --set development --part none --skip 1000 --out ${WORK}/c)
