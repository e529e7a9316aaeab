# flappy-eval as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-eval -DSOURCE=the project -DWORK=a folder to use -P eval_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

# The escape with an observation of 20 numbers, and an actor for it that always does the same: of one layer, all weights 0.
file(READ ${SOURCE}/configs/tasks/escape.toml task)
string(REGEX REPLACE "\nobservation = [^\n]*" "\nobservation = [\"goal_rotation\", \"position_error\", \"velocity\", \"body_rate\", \"beat_phase\"]" task "${task}")
file(WRITE ${WORK}/task.toml "${task}")
string(CONCAT observation "\"x_error\",\"y_error\",\"z_error\",\"x_velocity\",\"y_velocity\",\"z_velocity\","
  "\"roll_rate\",\"pitch_rate\",\"yaw_rate\",\"beat_sin\",\"beat_cos\"")
foreach(row IN ITEMS x y z)
  string(APPEND observation ",\"goal_R_${row}x\",\"goal_R_${row}y\",\"goal_R_${row}z\"")
endforeach()
string(REPEAT ",0" 83 weights)
string(REPEAT ",0" 19 mean)
string(REPEAT ",1" 19 scale)
file(WRITE ${WORK}/best.json "{\"schema\":1,\"task\":\"escape\",\"observation\":[${observation}],"
  "\"action\":[\"amplitude\",\"difference\",\"bias\",\"split_cycle\"],\"widths\":[20,4],\"hidden\":\"relu\","
  "\"mean\":[0${mean}],\"scale\":[1${scale}],\"clip\":10,\"weights\":[0${weights}]}")

# The same as a C header: in volts, the middle of the action's range.
function(write_header name observations step)
  file(WRITE ${WORK}/${name}.h "#define FLAPPY_POLICY_OBS ${observations}\n#define FLAPPY_POLICY_ACT 4\n"
    "static void flappy_policy_step(const float obs[FLAPPY_POLICY_OBS], float action[FLAPPY_POLICY_ACT]) {\n  ${step}\n}\n"
    "static int flappy_policy_selftest(void) { return 0; }\n")
endfunction()
write_header(policy 20 "action[0] = 1.5f; action[1] = action[2] = action[3] = 0.0f; (void)obs;")

# A run folder.
file(READ ${SOURCE}/configs/fly/escape.toml fly)
string(REPLACE "\"../" "\"${SOURCE}/configs/" fly "${fly}")
string(REPLACE "${SOURCE}/configs/tasks/escape.toml" "task.toml" run "${fly}")
string(REPLACE "precision" "actor = \"../best.json\"\nprecision" run "${run}")
file(WRITE ${WORK}/run/config/fly.toml "${run}")
set(run_fly "${run}")
file(COPY ${WORK}/best.json DESTINATION ${WORK}/run)
file(COPY ${WORK}/task.toml DESTINATION ${WORK}/run/config)

# What this needs: half a second of flight, few flights.
set(short --set flight.duration_s=0.65 --set task.success.keep.until_s=0.65)
set(few ${short} --episodes 70)

# ---- a table, and figures by name

run(${WORK}/run ${few} --json ${WORK}/run.json)
expect_equal("stderr" "${err}" "")
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^70 flights of 0.65 s, task escape, seed 1, test vehicles, float\n +policy +PID alone +ARC alone\n")
foreach(row IN ITEMS "success, %( +[0-9.]+)+\n" "95 % interval, from( +[0-9.]+)+\n" "time to capture, s, median( +[-0-9.]+)+\n"
    "overshoot, mm, median( +[-0-9.]+)+\n" "final position error, mm, median( +[0-9.]+)+\n" "final heading error, deg, median( +[0-9.]+)+\n"
    "energy of the manoeuvre, J, median( +[0-9.]+)+\n" "mean power, W, median( +[0-9.]+)+\n" "failed: never captured( +[0-9]+)+\n"
    "nominal vehicle, 20 flights" "time to it, s, median( +[-0-9.]+)+\n" "the hummingbird: 0.25 s; the study's optimum: 0.248 s\n" "hash [0-9a-f]+\n")
  expect_match("stdout" "${out}" "${row}")
endforeach()
# ---- what it survives

run(${WORK}/run ${short} --episodes 8 --effects --json ${WORK}/effects.json)
expect_match("stderr, where a slow machine is told how far it is" "${err}" "^(effects flown [0-9]+ %[^\n]*\n)*$")
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^8 flights each, task escape, seed 1, test vehicles: success, %, by magnitude of an effect in units of its typical one\n +0.5 +1 +1.5 +2\n  none +[0-9.]+\n")
file(READ ${WORK}/effects.json json)
string(JSON count LENGTH "${json}" effects)
string(REGEX MATCHALL "\n  [a-z_]+( +([0-9.]+|-))( +([0-9.]+|-))( +([0-9.]+|-))( +([0-9.]+|-))" rows "${out}")
list(LENGTH rows printed)
expect_equal("rows of effects" "${printed}" "${count}")
string(JSON hash GET "${json}" hash)
foreach(k IN ITEMS 0 8 12)  # of the vehicle, the battery, the gear: each flies otherwise
  string(JSON name GET "${json}" effects ${k} effect)
  string(JSON with GET "${json}" effects ${k} success 1 hash)
  if(with STREQUAL hash)
    message(SEND_ERROR "${name} changes nothing")
  endif()
endforeach()

# Of drawn effects nothing is left then; the worst and the mean are those of the rows.
run(${WORK}/run ${short} --episodes 8 --effects --magnitudes 2 --set drawn_effects.none=0 --set drawn_effects.most=1 --set drawn_effects.magnitude=2
  --json ${WORK}/drawn.json)
expect_equal("exit code" "${code}" 0)
file(READ ${WORK}/drawn.json drawn)
string(JSON drawn_hash GET "${drawn}" hash)
expect_equal("hash without the drawn effects" "${drawn_hash}" "${hash}")
string(JSON with GET "${json}" effects 3 success 3 hash)
string(JSON drawn_hash GET "${drawn}" effects 3 success 0 hash)
expect_equal("hash with an effect at twice its typical magnitude" "${drawn_hash}" "${with}")
expect_match("stdout" "${out}" "\n  the worst of these effects +[0-9.]+\n  their mean +[0-9.]+\n")
expect_refused("flappy-eval: --magnitudes requires --effects; see flappy-eval --help" ${WORK}/run --magnitudes 1)

# A file of a run folder flies as its run does: here 0.65 s without being told.
string(REGEX REPLACE "duration_s = [^\n]*" "duration_s = 0.65" brief "${run_fly}")
file(WRITE ${WORK}/brief/config/fly.toml "${brief}")
file(COPY ${WORK}/best.json DESTINATION ${WORK}/brief)
file(COPY ${WORK}/task.toml DESTINATION ${WORK}/brief/config)
run(${WORK}/brief/best.json --set task.success.keep.until_s=0.65 --episodes 2 --no-baselines)
expect_match("stdout of a run's file" "${out}" "^2 flights of 0.65 s, task escape")
set(figures episodes=NUMBER success_rate=NUMBER success_low=NUMBER success_high=NUMBER time_to_capture_median_s=NULL
  time_to_capture_p10_s=NULL time_to_capture_p90_s=NULL final_position_error_mm=NUMBER final_heading_error_deg=NUMBER
  overshoot_median_mm=NULL energy_median_J=NUMBER mean_power_median_W=NUMBER failures.crashed=NUMBER
  failures.not_finite=NUMBER failures.never_captured=NUMBER failures.lost_position=NUMBER failures.lost_tilt=NUMBER
  failures.lost_heading=NUMBER never_captured_missing.heading=NUMBER nominal.time_to_strict_median_s=NULL hash=STRING)
expect_keys(${WORK}/run.json ${figures} pid_success_rate=NUMBER arc_success_rate=NUMBER pid.success_low=NUMBER
  arc.energy_median_J=NUMBER seed=NUMBER task=STRING vehicles=STRING stopped=BOOLEAN config=OBJECT commit=STRING)
file(READ ${WORK}/run.json json)
set(failed 0)
foreach(cause IN ITEMS not_finite crashed out_of_bounds too_late never_captured lost_position lost_tilt lost_heading)
  string(JSON flights GET "${json}" failures ${cause})
  math(EXPR failed "${failed} + ${flights}")
endforeach()
expect_equal("flights that failed" "${failed}" 70)  # it does not even turn

# ---- the same bytes for any number of threads, and from every form of the policy

run(${WORK}/run ${few} --threads 1 --json ${WORK}/one.json)
run(${WORK}/run ${few} --threads 2 --json ${WORK}/two.json)
file(READ ${WORK}/one.json one)
file(READ ${WORK}/two.json two)
expect_equal("results on one thread" "${one}" "${json}")
expect_equal("results on two threads" "${two}" "${one}")
string(JSON error GET "${json}" final_position_error_mm)
foreach(policy IN ITEMS best.json policy.h)
  run(${WORK}/${policy} --task ${WORK}/task.toml ${few} --no-baselines --json ${WORK}/form.json)
  expect_equal("exit code of ${policy}: ${err}" "${code}" 0)
  file(READ ${WORK}/form.json form)
  string(JSON other GET "${form}" final_position_error_mm)
  expect_equal("error of ${policy}" "${other}" "${error}")
  expect_keys(${WORK}/form.json pid_success_rate=NULL arc_success_rate=NULL)
endforeach()
string(REPLACE "amplitude_V = [-5.0, 8.0]" "amplitude_V = [-5.0, 9.0]" other "${task}")
file(WRITE ${WORK}/other.toml "${other}")
string(REPLACE "[flight]" "[flight]\ncontrol_hz = 1000.0" fast "${fly}")
file(WRITE ${WORK}/fast.toml "${fast}")
foreach(different IN ITEMS "--seed;2" "--stream;validation" "--vehicle;${SOURCE}/configs/vehicles/hummingbird_identified.toml"
    "--set;controller.attitude.pitch.p=10" "--set;task=${WORK}/other.toml" "--config;${WORK}/fast.toml")
  run(${WORK}/best.json --task ${WORK}/task.toml ${few} ${different} --no-baselines --json ${WORK}/different.json)
  expect_equal("exit code of ${different}: ${err}" "${code}" 0)
  file(READ ${WORK}/different.json form)
  string(JSON other GET "${form}" final_position_error_mm)
  if(other STREQUAL error)
    message(SEND_ERROR "${different}: the same error ${error}")
  endif()
endforeach()

# ---- Ctrl-C: whole parts are written

find_program(TIMEOUT timeout REQUIRED)
execute_process(COMMAND ${TIMEOUT} --foreground --preserve-status -s INT 1 ${PROGRAM} ${WORK}/best.json --task ${WORK}/task.toml ${short}
  --episodes 100000 --threads 1 --json ${WORK}/int.json OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^stopped: policy flew [0-9]+ of 100000 flights\n")
file(READ ${WORK}/int.json json)
string(JSON stopped GET "${json}" stopped)
expect_equal("stopped" "${stopped}" ON)

# ---- what is refused

set(kinds "a run folder, an actor (.json), TorchScript (.pt), ONNX (.onnx) or a C header (.h)")
expect_refused("${WORK}/none.h: cannot be read: No such file or directory" ${WORK}/none.h)
file(MAKE_DIRECTORY ${WORK}/empty)
expect_refused("${WORK}/empty: holds no config/fly.toml; accepted: ${kinds}" ${WORK}/empty)
expect_refused("${SOURCE}/README.md: is no policy; accepted: ${kinds}" ${SOURCE}/README.md)
file(WRITE ${WORK}/untrained/config/fly.toml "${fly}")
expect_refused("${WORK}/untrained/config/fly.toml: actor: is missing; accepted: the trained actor's file" ${WORK}/untrained)
expect_refused("--config: ${WORK}/run has its own; accepted: --config with a single file" ${WORK}/run --config ${WORK}/fast.toml)
write_header(broken 20 "action[0] = ")
file(READ ${WORK}/broken.h text)
run(${WORK}/broken.h --task ${WORK}/task.toml)
expect_equal("exit code of a broken header" "${code}" 2)
expect_match("stderr" "${err}" "^${WORK}/broken.h:5:1: error: [^\n]*; accepted: a C header that cc compiles\n$")
write_header(other 18 "action[0] = obs[17];")
expect_refused("${WORK}/other.h: has 18 inputs and 4 outputs; accepted: 20 and 4, as the task has" ${WORK}/other.h --task ${WORK}/task.toml)
file(WRITE ${WORK}/broken.pt "nothing")
run(${WORK}/broken.pt)
expect_equal("exit code of a broken .pt" "${code}" 2)
expect_match("stderr" "${err}" "^${WORK}/broken.pt: [^\n]*; [^\n]*\n$")
run(${WORK}/best.json --task ${WORK}/task.toml --set "task.observation=[\"position_error\"]")
expect_equal("exit code of an actor for another task" "${code}" 2)
expect_match("stderr" "${err}" "actor: observes something else than task \"escape\"")
expect_refused("task \"hover\" does not say what a success is; accepted: a task with [success.capture] and [success.keep]"
  ${WORK}/policy.h --config ${SOURCE}/configs/fly/hover.toml --set "task.observation=[\"goal_rotation\", \"position_error\", \"velocity\", \"body_rate\", \"beat_phase\"]")
expect_refused("task \"escape\" would be flown without its excitation, which flappy-fly alone adds; accepted: a configuration without"
  ${WORK}/best.json --task ${WORK}/task.toml --set constant_input.bias_V=1)
expect_refused("flappy-eval: --episodes: Value 0 not in range 1 to 100000; see flappy-eval --help" ${WORK}/best.json --episodes 0)
expect_refused("flappy-eval: --stream: training not in {test,validation}; see flappy-eval --help" ${WORK}/best.json --stream training)
expect_refused("flappy-eval: policy is required; see flappy-eval --help")
expect_refused("flappy-eval: --episode: no such option; accepted: --allow-network, --config, --effects, --episodes, --help, --json, --log-level, --magnitudes, --no-baselines, --progress, --seed, --set, --stream, --task, --threads, --vehicle, --version; did you mean \"--episodes\"?; see flappy-eval --help" ${WORK}/best.json --episode=5)

# ---- no output replaces what is read

expect_kept(${WORK}/run/best.json --json ${WORK}/run ${few})
