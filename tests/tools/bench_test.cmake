# flappy-bench as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-bench -DSOURCE=the project -DWORK=a folder to use -P bench_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

# ---- a batch

string(CONCAT good
  "schema = 1\n"
  "vehicle = \"${SOURCE}/configs/vehicles/hummingbird_nominal.toml\"\n"
  "precision = \"float\"\n"
  "count = 70\n"
  "seed = 1\n"
  "duration_s = 0.05\n"
  "step_s = 1e-4\n"
  "[input]\n"
  "amplitude_V = 9.8\n")
string(CONCAT randomisation
  "schema = 1\n"
  "[[randomise]]\n"
  "parameters = [\"torso.mass_kg\", \"torso.inertia_kg_m2\"]\n"
  "law = \"scale_normal\"\n"
  "sd = 0.1\n")
file(WRITE ${WORK}/randomisation.toml "${randomisation}")
string(REPLACE "[input]" "randomisation = \"randomisation.toml\"\n[input]" good "${good}")
file(WRITE ${WORK}/good.toml "${good}")

foreach(threads IN ITEMS 1 2)
  run(batch ${WORK}/good.toml --set threads=${threads} --json ${WORK}/batch${threads}.json)
  expect_equal("exit code" "${code}" 0)
  expect_equal("stderr" "${err}" "")
  file(READ ${WORK}/batch${threads}.json json)
  string(JSON hash${threads} GET "${json}" hash)
endforeach()
expect_equal("hash by two threads" "${hash2}" "${hash1}")
if(NOT out MATCHES "state hash ${hash2}\n")
  message(SEND_ERROR "the hash is not printed: ${out}")
endif()
run(batch --set seed=2 ${WORK}/good.toml --set threads=2 --json ${WORK}/seed.json)
file(READ ${WORK}/seed.json json)
string(JSON hash GET "${json}" hash)
if(hash STREQUAL hash1)
  message(SEND_ERROR "another seed, the same hash ${hash}")
endif()

expect_keys(${WORK}/batch1.json flappers=NUMBER steps=NUMBER wall_s=NUMBER steps_per_s=NUMBER climb_median_m=NUMBER
  drift_median_m=NUMBER frozen=NUMBER hash=STRING)

# ---- the benchmark, as short as it gets

run(--rounds 1 --seconds 0.01 --no-peers --json ${WORK}/speed.json)
expect_equal("exit code" "${code}" 0)
expect_keys(${WORK}/speed.json closed_loop_control_steps_per_s=NUMBER bytes_per_flapper_closed_loop=NUMBER
  closed_loop_shares=OBJECT float_steps_per_s=NUMBER double_steps_per_s=NUMBER two_thread_scaling=NUMBER
  dart_steps_per_s=NULL mujoco_steps_per_s=NULL thrust_error=NUMBER position_error_m=NUMBER
  bytes_per_flapper=NUMBER ns_per_step_1000=NUMBER ns_per_step_100000=NUMBER flops_per_step=NUMBER
  roof_steps_per_s=NUMBER instruction_set=STRING)
file(READ ${WORK}/speed.json json)
string(JSON set GET "${json}" instruction_set)

# Every integrator of the study tends to our own fine run: the table shows no figure that is none.
function(expect_below what actual limit)
  if(NOT actual LESS limit)
    message(SEND_ERROR "${what} is ${actual}, should be below ${limit}")
  endif()
endfunction()
string(JSON error GET "${json}" position_error_m)
expect_below("position error at 100 us" "${error}" 3e-3)
if(DEFINED ENV{FLAPPY_FULL_TESTS})  # a minute
  run(convergence --json ${WORK}/convergence.json)
  expect_equal("exit code" "${code}" 0)
  file(READ ${WORK}/convergence.json json)
  foreach(row RANGE 23)
    string(JSON name GET "${json}" integrators ${row} integrator)
    string(JSON step GET "${json}" integrators ${row} step_s)
    string(JSON error GET "${json}" integrators ${row} position_error_m)
    expect_below("error of ${name} at ${step} s" "${error}" 0.01)
    if(step LESS 1.5e-5)
      expect_below("error of ${name} at ${step} s" "${error}" 3e-4)
    endif()
  endforeach()
endif()

# ---- the learner's

run(--rounds 1 --seconds 0.01 --no-peers learner --json ${WORK}/learner.json)
expect_equal("exit code" "${code}" 0)
expect_keys(${WORK}/learner.json learner=ARRAY peak_multiply_adds_per_s=NUMBER instruction_set=STRING)
file(READ ${WORK}/learner.json json)
string(JSON rate GET "${json}" learner 1 updates_per_s)
if(NOT rate GREATER 0)
  message(SEND_ERROR "the learner does ${rate} updates/s")
endif()

# ---- beside busy processors: of so short a run the figures mean nothing yet

run(--rounds 1 --seconds 0.01 busy --json ${WORK}/busy.json)
expect_equal("exit code" "${code}" 0)
expect_keys(${WORK}/busy.json busy=ARRAY processors=NUMBER instruction_set=STRING)
file(READ ${WORK}/busy.json json)
foreach(row RANGE 8)
  string(JSON ratio GET "${json}" busy ${row} ratio)
  if(NOT ratio GREATER 0.01)
    message(SEND_ERROR "beside busy processors nothing is done: ${ratio} of the work")
  endif()
endforeach()

run(--version)
expect_equal("exit code" "${code}" 0)
foreach(line IN ITEMS "^flappy-bench [0-9]+\\.[0-9]+\\.[0-9]+\n" "\ncommit ([0-9a-f]+(-dirty)?|unknown)\n" "\ninstruction set ${set}\n"
    "\ncompiler " "\nCLI11 " "\nnlohmann-json ")
  if(NOT out MATCHES "${line}")
    message(SEND_ERROR "--version lacks ${line}: ${out}")
  endif()
endforeach()

# ---- what is refused: `old` of the good configuration replaced by `new`; `line` follows the file's name

function(expect_edit_refused old new line)
  string(REPLACE "${old}" "${new}" text "${good}")
  file(WRITE ${WORK}/bad.toml "${text}")
  expect_refused("${WORK}/bad.toml${line}" batch ${WORK}/bad.toml)
endfunction()

expect_edit_refused("seed = 1" "sed = 1"
  ":5:1: sed: unknown key; accepted: count, duration_s, input, precision, randomisation, schema, seed, step_s, threads, vehicle, world; did you mean \"seed\"?")
expect_edit_refused("seed = 1" "seed = 1\nthread = 1"
  ":6:1: thread: unknown key; accepted: count, duration_s, input, precision, randomisation, schema, seed, step_s, threads, vehicle, world; did you mean \"threads\"?")
expect_edit_refused("duration_s = 0.05" "duration_s = \"long\""
  ":6:14: duration_s: is a string; accepted: a number above 0, at most 1000")
expect_edit_refused("count = 70" "count = -70" ":4:9: count: -70 is out of range; accepted: an integer from 1 to 1000000")
expect_edit_refused("amplitude_V = 9.8" "amplitude_V = nan" ":10:15: input.amplitude_V: nan is not finite; accepted: a number from 0 to 18")
expect_edit_refused("amplitude_V = 9.8" "amplitude_V = 98.0"
  ":10:15: input.amplitude_V: 98 is out of range; accepted: a number from 0 to 18")
expect_edit_refused("seed = 1" "seed = 1\nseed = 1"
  ":6:8: not valid TOML: Error while parsing key-value pair: cannot redefine existing integer 'seed'")
expect_edit_refused("amplitude_V = 9.8\n" "amplitude_V = 9.8\nlaw"
  ":11:4: not valid TOML: Error while parsing key-value pair: encountered end-of-file")
expect_edit_refused("step_s = 1e-4" "step_s = 3e-4"
  ":7:10: step_s: does not divide the driver's hold of 0.001 s; accepted: hold_s / n")
string(REPLACE "sd = 0.1" "sd = 0.4" wide "${randomisation}")
file(WRITE ${WORK}/wide.toml "${wide}")
expect_refused("${WORK}/wide.toml:3:14: randomise[0].parameters: torso.mass_kg could become -0.00218134; accepted: draws between 1e-09 and 10"
  batch ${WORK}/good.toml --set randomisation=wide.toml)
file(WRITE ${WORK}/no_schema.toml "")
expect_refused("${WORK}/no_schema.toml: schema: is missing; accepted: 1" batch ${WORK}/no_schema.toml)
expect_refused("--set count=0: count: 0 is out of range; accepted: an integer from 1 to 1000000"
  batch ${WORK}/good.toml --set count=0)
expect_refused("${WORK}/none.toml: cannot be read: No such file or directory" batch ${WORK}/none.toml)
expect_refused("${WORK}: cannot be read: Is a directory" batch ${WORK})

file(READ ${SOURCE}/configs/vehicles/hummingbird_nominal.toml vehicle)
string(REPLACE "mass_kg = 10.9067e-3" "mass_kg = -10.9067e-3" heavy "${vehicle}")
string(REGEX MATCH "^.*mass_kg = -10" before "${heavy}")
string(REGEX MATCHALL "\n" lines "${before}")
list(LENGTH lines line)
math(EXPR line "${line} + 1")
file(WRITE ${WORK}/heavy.toml "${heavy}")
expect_refused("${WORK}/heavy.toml:${line}:11: torso.mass_kg: -0.0109067 is out of range; accepted: a number from 1e-09 to 10"
  batch ${WORK}/good.toml --set vehicle=\"${WORK}/heavy.toml\")
expect_refused("${WORK}/heavy.toml:${line}:11: torso.mass_kg: -0.0109067 is out of range; accepted: a number from 1e-09 to 10"
  --vehicle ${WORK}/heavy.toml)

expect_refused("flappy-bench: --fast: no such option; accepted: --figures, --help, --json, --log-level, --no-peers, --progress, --rounds, --seconds, --vehicle, --version; see flappy-bench --help" --fast)
expect_refused("flappy-bench: --rounds: Value 0 not in range 1 to 1000; see flappy-bench --help" --rounds 0)
expect_refused("flappy-bench: config is required; see flappy-bench --help" batch)

# ---- a place that cannot be written is found out before the work, which here would outlast the test

foreach(place IN ITEMS "${WORK}/none/x.json: cannot be written: No such file or directory" "${WORK}: cannot be written: Is a directory"
    "/dev/null: cannot be written: Not a regular file")
  string(REGEX REPLACE ": .*" "" path "${place}")
  execute_process(COMMAND ${PROGRAM} batch ${WORK}/good.toml --set count=100000 --set duration_s=1000 --json ${path}
    OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code TIMEOUT 10)
  expect_equal("stderr" "${err}" "${place}\n")
  expect_equal("stdout" "${out}" "")
  expect_equal("exit code" "${code}" 2)
endforeach()

# ---- growing work

run(scale --of "jobs in a queue" --share 0.001 --json ${WORK}/scale.json)
expect_equal("exit code" "${code}" 0)
file(READ ${WORK}/scale.json json)
string(JSON rows LENGTH "${json}" rows)
expect_equal("sizes up to a hundred jobs" "${rows}" 2)
string(JSON size GET "${json}" rows 1 size)
expect_equal("the larger one" "${size}" 100.0)
string(JSON power GET "${json}" rows 1 power)
if(NOT power GREATER 0)
  message(SEND_ERROR "a hundred jobs take no longer than ten: ${json}")
endif()
run(scale --of job)
expect_equal("stdout of a scale that is not known" "${out}" "")
if(NOT err MATCHES "^--of job: is not known; accepted: .*jobs in a queue")
  message(SEND_ERROR "${err}")
endif()
run(work-precision --flights ${WORK}/flights)
if(NOT EXISTS ${WORK}/flights/flights.json AND NOT err MATCHES "has neither MuJoCo nor DART")
  message(SEND_ERROR "no flights are written: ${err}")
endif()
