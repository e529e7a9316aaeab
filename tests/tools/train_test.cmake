# flappy-train as a person meets it: what it prints, writes and refuses, and what is left of a run that is killed.
#   cmake -DPROGRAM=flappy-train -DSOURCE=the project -DWORK=a folder to use -P train_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)
find_program(TIMEOUT timeout REQUIRED)
set(escape ${SOURCE}/configs/train/escape.toml)
set(small --set collect.flappers=48 --set collect.vehicles=16 --set networks.critic=[32,32] --set learn.replay=4000
  --set learn.batch=64 --set evaluate.vehicles=32 --set flight.duration_s=0.4 --set task.success.keep.from_s=0.36
  --set task.success.keep.until_s=0.4)
set(some ${small} --set learn.updates=30000 --set evaluate.every=6000 --set checkpoint.every=600)

# ---- a run and what it leaves

run(${escape} ${some} --out ${WORK}/whole --threads 1 --json ${WORK}/whole.json)
expect_match("stderr, where a slow machine is told how far it is" "${err}" "^(trained [0-9]+ %[^\n]*\n)*$")
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^${WORK}/whole: seed 0, 1 threads, [0-9]+ MB of memory, at most [0-9]+ MB on disk\n")
foreach(row IN ITEMS "trained: seed 0, 30000 updates in [0-9.]+ s .and [0-9.]+ s of evaluation., [0-9.]+ million environment steps\n"
    "best success on validation vehicles: [0-9.]+ %, at update [0-9]+\n" "time to 50, 80, 90, 95 % success:( [-0-9.s]+)+\n"
    "simulation [0-9]+ %, learning [0-9]+ %, the rest [0-9]+ %" "policy ${WORK}/whole/best.json, last checkpoint's payload [0-9a-f]+\n"
    "\nshown by: flappy-report ${WORK}/whole --out report.html\n$")
  expect_match("stdout" "${out}" "${row}")
endforeach()
set(figures seed=NUMBER wall_s=NUMBER env_steps=NUMBER updates=NUMBER time_to_95_s=NULL share_simulation=NUMBER
  share_learning=NUMBER payload_sha256=STRING)
expect_keys(${WORK}/whole.json ${figures})
expect_keys(${WORK}/whole/summary.json ${figures})
expect_keys(${WORK}/whole/run.json commit=STRING processor=STRING instruction_set=STRING seed=NUMBER)

file(READ ${WORK}/whole/log.txt text)
set(time "[-0-9]+T[0-9:.+-]+")
expect_match("log.txt" "${text}" "^${time} info: flappy-train [0-9.]+, commit [^ ]+: [^\n]+--threads 1[^\n]*\n(${time} info: update [0-9]+: [^\n]+\n)+${time} info: trained, update 30000\n$")

# What a run must leave, to the byte.
function(digest folder result)
  set(all)
  foreach(name IN ITEMS best.json last.json metrics.jsonl metrics.csv)
    file(SHA256 ${folder}/${name} hash)
    list(APPEND all ${name} ${hash})
  endforeach()
  file(READ ${folder}/summary.json json)
  string(JSON payload GET "${json}" payload_sha256)
  set(${result} ${all} payload ${payload} PARENT_SCOPE)
endfunction()
digest(${WORK}/whole expected)

# ---- a finished run stays as it is

file(SHA256 ${WORK}/whole/summary.json before)
run(--resume ${WORK}/whole --json ${WORK}/finished.json)
expect_equal("exit code: ${err}" "${code}" 0)
expect_equal("stdout" "${out}" "${WORK}/whole: is finished: seed 0, 30000 updates; nothing is left to do\nshown by: flappy-report ${WORK}/whole --out report.html\n")
file(SHA256 ${WORK}/whole/summary.json after)
expect_equal("summary.json of a finished run" "${after}" "${before}")
file(SHA256 ${WORK}/finished.json after)
expect_equal("--json of a finished run" "${after}" "${before}")

# ---- killed six times at random moments: the same bytes in the end

string(RANDOM LENGTH 6 ALPHABET 0123456789 moments)
set(command ${escape} ${some} --out ${WORK}/killed --threads 2)
set(kills 0)
foreach(k RANGE 5)
  string(SUBSTRING "${moments}" ${k} 1 moment)
  execute_process(COMMAND ${TIMEOUT} -s KILL 0.${moment}7 ${PROGRAM} ${command} OUTPUT_QUIET ERROR_VARIABLE err RESULT_VARIABLE code)
  if(code EQUAL 137 OR code MATCHES "killed")
    math(EXPR kills "${kills} + 1")
  elseif(NOT code EQUAL 0)
    message(SEND_ERROR "after kills at 0.[${moments}]7 s: exit code ${code}: ${err}")
  endif()
  if(EXISTS ${WORK}/killed/run.json)
    set(command --resume ${WORK}/killed --threads 1)
  endif()
endforeach()
run(${command})
expect_equal("exit code after kills at 0.[${moments}]7 s: ${err}" "${code}" 0)
if(kills LESS 3)
  message(SEND_ERROR "killed but ${kills} times: the run is too short for this test")
endif()
digest(${WORK}/killed actual)
expect_equal("after kills at 0.[${moments}]7 s" "${actual}" "${expected}")

# ---- Ctrl-C: checkpoint, summary, and how to go on

execute_process(COMMAND ${TIMEOUT} --foreground --preserve-status -s INT 1 ${PROGRAM} ${escape} ${small} --set learn.updates=1000000
  --set evaluate.every=1000000 --set checkpoint.every=1000000 --out ${WORK}/stopped OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "stopped: seed 0, [0-9]+ updates in .*go on: flappy-train --resume ${WORK}/stopped\n")
expect_keys(${WORK}/stopped/summary.json updates=NUMBER stopped=BOOLEAN)
file(GLOB checkpoints ${WORK}/stopped/checkpoint_*.flappy)
list(LENGTH checkpoints count)
expect_equal("checkpoints, of the start and of the stop" "${count}" 2)

# ---- several seeds

run(${escape} ${small} --set learn.updates=60 --set evaluate.every=30 --seeds 1-2 --out ${WORK}/seeds --json ${WORK}/seeds.json)
expect_equal("exit code: ${err}" "${code}" 0)
file(STRINGS ${WORK}/seeds/curve.csv lines)
list(LENGTH lines count)
expect_equal("lines of curve.csv" "${count}" 3)
file(READ ${WORK}/seeds/curve.svg svg)
expect_match("curve.svg" "${svg}" "<svg ")
file(READ ${WORK}/seeds.json json)
string(JSON count LENGTH "${json}")
expect_equal("summaries" "${count}" 2)

# ---- trained on with what a diagnosis of its vehicle corrected: what its long name does, to the byte

file(READ ${WORK}/whole/config/vehicle.toml vehicle)
string(REGEX REPLACE "name = [^\n]+" "name = \"hummingbird_nominal_corrected\"" vehicle "${vehicle}")
string(REGEX REPLACE "resistance_ohm = [0-9.]+" "resistance_ohm = 13.0" vehicle "${vehicle}")
file(WRITE ${WORK}/diagnosis/vehicle_corrected.toml "${vehicle}")
file(WRITE ${WORK}/diagnosis/diagnosis.json "{}")
set(briefly --set learn.updates=600 --set evaluate.every=600)
run(--adapt ${WORK}/diagnosis --init ${WORK}/whole ${briefly} --out ${WORK}/adapted)
expect_equal("exit code: ${err}" "${code}" 0)
run(${WORK}/whole/config/train.toml --set vehicle=${WORK}/diagnosis/vehicle_corrected.toml --init ${WORK}/whole ${briefly} --out ${WORK}/long)
expect_equal("exit code: ${err}" "${code}" 0)
digest(${WORK}/adapted short)
digest(${WORK}/long actual)
expect_equal("what --adapt leaves" "${short}" "${actual}")
expect_refused("flappy-train: --adapt requires --init; see flappy-train --help" --adapt ${WORK}/diagnosis)
expect_refused("${escape}: --adapt trains on with the configuration of the run ${WORK}/whole; accepted: no other one" ${escape} --adapt ${WORK}/diagnosis --init ${WORK}/whole)
expect_refused("--set vehicle=v.toml: --adapt sets the vehicle; accepted: other keys" --adapt ${WORK}/diagnosis --init ${WORK}/whole --set vehicle=v.toml)
expect_refused("${WORK}/whole/best.json: is no run folder; accepted: a folder that flappy-train left" --adapt ${WORK}/diagnosis --init ${WORK}/whole/best.json)
set(finished "accepted: the folder of a finished flappy-gap diagnose --out")
expect_refused("${WORK}/none: has no diagnosis.json; ${finished}" --adapt ${WORK}/none --init ${WORK}/whole)
file(WRITE ${WORK}/faulty/diagnosis.json "{}")
expect_refused("${WORK}/faulty: has no vehicle_corrected.toml: its data are faulty, or it was stopped; ${finished}" --adapt ${WORK}/faulty --init ${WORK}/whole)
string(REPLACE hummingbird_nominal_corrected robobee_corrected vehicle "${vehicle}")
file(WRITE ${WORK}/faulty/vehicle_corrected.toml "${vehicle}")
expect_refused("${WORK}/faulty: is a diagnosis of vehicle \"robobee\", but ${WORK}/whole flies \"hummingbird_nominal\"; accepted: a diagnosis of that vehicle, or --set vehicle in place of --adapt"
  --adapt ${WORK}/faulty --init ${WORK}/whole)

# ---- what is refused

expect_refused("flappy-train: --log-level: loud not in {debug,info,warning,error}; see flappy-train --help" --log-level loud)
expect_refused("${WORK}/whole: holds a run; accepted: a new folder, or --resume ${WORK}/whole" ${escape} ${some} --out ${WORK}/whole)
expect_refused("flappy-train: what to train is not clear; accepted: a configuration, --resume RUN, or --adapt DIAGNOSIS --init RUN")
expect_refused("${WORK}/none: is no run folder; accepted: a folder that flappy-train left" --resume ${WORK}/none)
expect_refused("${WORK}/seeds: holds runs of several seeds; accepted: a new folder, or --seeds" ${escape} ${small} --out ${WORK}/seeds)
expect_refused("${WORK}/whole: holds a run of its own; accepted with --seeds: a new folder, or one of --seeds" ${escape} ${some} --seeds 0-1 --out ${WORK}/whole)
execute_process(COMMAND ${PROGRAM} ${escape} --seeds "" --out ${WORK}/refused ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("--seeds of nothing" "${code} ${err}" "2 flappy-train: --seeds: is empty; accepted: a value; see flappy-train --help\n")
expect_refused("--seeds 4-2: is no range of seeds; accepted: 0-4" ${escape} --seeds 4-2)
expect_refused("--set learn.speed=1: learn.speed: unknown key; accepted: actor_after, actor_rate, averaging, batch, critic_rate, device, engine, gradient_clip, huber, last_rate, policy_averaging, policy_delay, replay, schedule, target_noise, target_noise_clip, twin, updates, updates_per_step, warm_up, weight_decay"
  ${escape} --set learn.speed=1 --out ${WORK}/refused)
expect_refused("${WORK}/none.json: cannot be read: No such file or directory" ${escape} --init ${WORK}/none.json --out ${WORK}/refused)
file(TOUCH ${WORK}/file)
expect_refused("${WORK}/file: cannot be written: Not a directory" ${escape} --out ${WORK}/file)

# of a run that was killed before its end, a damaged checkpoint is named, and the one before is offered
file(GLOB checkpoints ${WORK}/whole/checkpoint_*.flappy)
list(SORT checkpoints)
list(GET checkpoints -1 newest)
list(GET checkpoints -2 before)
get_filename_component(before_name ${before} NAME)
file(REMOVE ${WORK}/whole/summary.json)
execute_process(COMMAND sh -c "head -c -5 ${newest} > ${newest}.cut && mv ${newest}.cut ${newest}")
run(--resume ${WORK}/whole)
expect_equal("exit code" "${code}" 2)
expect_match("stderr" "${err}" "^${newest}: .*${before_name}, is good: --resume ${WORK}/whole --from ${before_name}\n$")
run(--resume ${WORK}/whole --from ${before_name})
expect_equal("exit code" "${code}" 0)
digest(${WORK}/whole actual)
expect_equal("from the one before" "${actual}" "${expected}")

# ---- no output replaces what is read

expect_kept(${WORK}/whole/best.json --json ${escape} ${some} --init ${WORK}/whole --out ${WORK}/kept)
expect_kept(${WORK}/whole/config/train.toml --json --resume ${WORK}/whole)
