# flappy-export as a person meets it: what it prints, writes and refuses.
#   cmake -DPROGRAM=flappy-export -DTRAIN=flappy-train -DEVAL=flappy-eval -DSOURCE=the project -DWORK=a folder to use -P export_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)
find_program(TIMEOUT timeout REQUIRED)
set(small --set collect.flappers=48 --set collect.vehicles=16 --set networks.critic=[32,32] --set learn.replay=4000
  --set learn.batch=64 --set evaluate.vehicles=32 --set flight.duration_s=0.7 --set task.success.keep.until_s=0.7)
execute_process(COMMAND ${TRAIN} ${SOURCE}/configs/train/escape.toml ${small} --set learn.updates=600
  --set evaluate.every=300 --set checkpoint.every=600 --out ${WORK}/run OUTPUT_QUIET RESULT_VARIABLE code)
expect_equal("exit code of flappy-train" "${code}" 0)

# ---- what it leaves, and says

run(${WORK}/run --out ${WORK}/out --int8 --json ${WORK}/out.json)
expect_equal("stderr" "${err}" "")
expect_equal("exit code" "${code}" 0)
foreach(row IN ITEMS "8 bits differ by at most, % of an output's range: amplitude [0-9.e+-]+ .rms [0-9.e+-]+., difference"
    "flappy_policy.h\ncompiler +target +options +self-test +differ +of +by\ncc [0-9.]+ +x86_64 +gnu99 -O2 +passed +0 +4000 +0\n"
    "${WORK}/out/flappy_policy.h: [0-9]+ bytes\n" "${WORK}/out/flappy_controller.h: [0-9]+ bytes\n")
  expect_match("stdout" "${out}" "${row}")
endforeach()
expect_keys(${WORK}/out.json run=STRING config_sha256=STRING int8_error.largest=ARRAY parity=OBJECT)
file(GLOB left RELATIVE ${WORK}/out ${WORK}/out/* ${WORK}/out/.*)
set(expected README.md contract.json flappy_controller.h flappy_policy.h flappy_policy_int8.h)
expect_keys(${WORK}/out/contract.json policy_crc32=NUMBER controller_crc32=NUMBER period_us.control=NUMBER observation=ARRAY normalisation.mean=ARRAY
  test_vectors.action=ARRAY)
if(TORCH)
  list(APPEND expected policy.pt)
  expect_match("stdout" "${out}" "TorchScript differs by at most, % of an output's range: amplitude [0-9.e-]+ ")
else()
  expect_match("stdout" "${out}" "policy.pt is not written: this build has no LibTorch .package flappy-torch.\n")
endif()
if(ONNX)
  list(APPEND expected policy.onnx)
else()
  expect_match("stdout" "${out}" "policy.onnx is not written: this build has no ONNX library\n")
endif()
if(RUNTIME)
  expect_match("stdout" "${out}" "onnxruntime [0-9.]+ differs by at most, % of an output's range: amplitude [0-9.e-]+ ")
endif()
list(SORT expected)
expect_equal("files" "${left}" "${expected}")

# the same bytes again, elsewhere, of a run that lies elsewhere and was not trained anew; no date, no path
file(COPY ${WORK}/run DESTINATION ${WORK}/moved)
run(${WORK}/moved/run --out ${WORK}/again/folder --int8)
foreach(name IN LISTS left)
  file(SHA256 ${WORK}/out/${name} first)
  file(SHA256 ${WORK}/again/folder/${name} second)
  expect_equal("bytes of ${name}" "${first}" "${second}")
  file(STRINGS ${WORK}/out/${name} named REGEX "${WORK}")
  expect_equal("paths in ${name}" "${named}" "")
endforeach()

# it flies every episode as the run does: the same count, the same hash of all motion
function(flown result)
  execute_process(COMMAND ${EVAL} ${ARGN} --episodes 24 --no-baselines --json ${WORK}/eval.json OUTPUT_QUIET ERROR_VARIABLE err
    RESULT_VARIABLE code)
  expect_equal("exit code of flappy-eval: ${err}" "${code}" 0)
  file(READ ${WORK}/eval.json json)
  string(JSON rate GET "${json}" success_rate)
  string(JSON hash GET "${json}" hash)
  set(${result} "${rate} ${hash}" PARENT_SCOPE)
endfunction()
flown(of_run ${WORK}/run)
flown(of_header ${WORK}/out/flappy_policy.h --config ${WORK}/run/config/fly.toml)
expect_equal("flights of the header" "${of_header}" "${of_run}")
if(RUNTIME)  # sums in another order: the same success, not the same bits
  flown(of_onnx ${WORK}/out/policy.onnx --config ${WORK}/run/config/fly.toml)
  string(REGEX REPLACE " .*" "" rate_of_run "${of_run}")
  string(REGEX REPLACE " .*" "" rate_of_onnx "${of_onnx}")
  expect_equal("success of policy.onnx" "${rate_of_onnx}" "${rate_of_run}")
endif()

# ---- two policies in one program: each with a prefix of its own

run(${WORK}/run --out ${WORK}/one --name one)
expect_equal("stderr" "${err}" "")
expect_match("stdout" "${out}" "${WORK}/one/one_policy.h: [0-9]+ bytes\n")
flown(of_named ${WORK}/one/one_policy.h --config ${WORK}/run/config/fly.toml)
expect_equal("flights of the named header" "${of_named}" "${of_run}")
function(compiled result first second)
  file(WRITE ${WORK}/two.c "#include \"${first}\"\n#include \"${second}\"\nint main(void) { return ${ARGN}; }\n")
  execute_process(COMMAND cc -std=c99 -O1 -Wall -Wextra -Wfloat-equal -Wconversion -Werror ${WORK}/two.c -o ${WORK}/two ERROR_VARIABLE err RESULT_VARIABLE code)
  if(code EQUAL 0)
    execute_process(COMMAND ${WORK}/two RESULT_VARIABLE err)
  endif()
  set(${result} "${err}" PARENT_SCOPE)
endfunction()
compiled(two ${WORK}/out/flappy_policy.h ${WORK}/one/one_policy.h "flappy_policy_selftest() + one_policy_selftest()")
expect_equal("two policies" "${two}" 0)
compiled(one ${WORK}/one/one_policy.h ${WORK}/one/one_controller.h "one_policy_selftest() + one_controller_selftest()")
expect_equal("policy and controller of one prefix" "${one}" 0)
compiled(twice ${WORK}/out/flappy_policy.h ${WORK}/out/flappy_policy_int8.h "flappy_policy_selftest()")
expect_match("two policies of one prefix" "${twice}" "#error \"another header of this prefix was included before: flappy-export --name gives one of its own\"")
foreach(flag IN ITEMS -ffast-math -freciprocal-math -fassociative-math -funsafe-math-optimizations)
  file(WRITE ${WORK}/fast.c "#include \"${WORK}/one/one_policy.h\"\n")
  execute_process(COMMAND cc ${flag} -fno-signed-zeros -fno-trapping-math -c ${WORK}/fast.c -o ${WORK}/fast.o ERROR_VARIABLE err)
  expect_match("complaint of ${flag}" "${err}" "#error \"${flag}[, ]")
endforeach()
expect_refused("--name: \"1st\" begins no name; accepted: small letters, digits and _, a letter first, at most 40"
  ${WORK}/run --out ${WORK}/refused --name 1st)
file(WRITE ${WORK}/foreign/px4/README.md "of somebody else\n")
expect_refused("${WORK}/foreign/px4: is no app that flappy-export made; accepted: another --out" ${WORK}/run --out ${WORK}/foreign --for px4)

# ---- any network that LibTorch trains: layer norm, another activation, a history, more layers

if(TORCH)
  execute_process(COMMAND ${TRAIN} ${SOURCE}/configs/train/escape.toml ${small} --set learn.updates=300 --set evaluate.every=300
    --set checkpoint.every=300 --set learn.engine=libtorch --set networks.activation=silu --set networks.layer_norm=true
    --set networks.actor=[24,40,9] --set task.history=2 --out ${WORK}/deep OUTPUT_QUIET RESULT_VARIABLE code)
  expect_equal("exit code of flappy-train" "${code}" 0)
  run(${WORK}/deep --out ${WORK}/deep_out)
  expect_equal("stderr" "${err}" "")
  expect_match("stdout" "${out}" " passed +0 +4000 +0\n")
  flown(of_deep ${WORK}/deep)
  flown(of_deep_header ${WORK}/deep_out/flappy_policy.h --config ${WORK}/deep/config/fly.toml)
  expect_equal("flights of the deep header" "${of_deep_header}" "${of_deep}")
  expect_refused("--int8: whole numbers hold no layer norm, linear output, elu or silu; accepted: a policy of relu or tanh without them"
    ${WORK}/deep --out ${WORK}/deep_int8 --int8)

  # a policy with a memory, whose one teacher knows late commands
  set(no_effects)
  foreach(effect IN ITEMS com_offset inertia_products wing_inertia wing_damage driver_dead_zone driver_bandwidth winding_heating battery_sag coulomb_friction
      spring_hardening stop_compliance gear_backlash wind wing_flexibility rotational_lift wake_capture clap_and_fling ground_effect ceiling_effect added_mass
      wall_effect body_drag tether gyro_bias accelerometer_misalignment vibration_rectification mocap_tilt marker_offset mocap_delay)
    list(APPEND no_effects --set drawn_effects.weights.${effect}=0)
  endforeach()
  execute_process(COMMAND ${TRAIN} ${SOURCE}/configs/train/escape_student.toml ${small} --init ${WORK}/run --set fly=../fly/escape.toml
    --set drawn_effects.none=0.5 --set drawn_effects.most=1 --set drawn_effects.magnitude=1.0 ${no_effects} --set student.teacher_updates=6
    --set student.rounds=4 --set student.flights=64 --set student.steps=20 --set student.batch=16 --out ${WORK}/student
    OUTPUT_QUIET ERROR_VARIABLE err RESULT_VARIABLE code)
  expect_equal("exit code of flappy-train: ${err}" "${code}" 0)
  run(${WORK}/student --out ${WORK}/student_out --int8)
  expect_equal("stderr" "${err}" "")
  expect_match("stdout" "${out}" " passed +0 +20000 +0\n.* passed +0 +20000 +0\n")
  flown(of_student ${WORK}/student)
  flown(of_student_header ${WORK}/student_out/flappy_policy.h --config ${WORK}/student/config/fly.toml)
  expect_equal("flights of the header with a memory" "${of_student_header}" "${of_student}")
endif()

flown(of_int8 ${WORK}/out/flappy_policy_int8.h --config ${WORK}/run/config/fly.toml)
if(of_int8 STREQUAL of_run)
  message(SEND_ERROR "8 bits fly to the bit as 32 do")
endif()

file(READ ${WORK}/out.json json)
foreach(k RANGE 3)
  string(JSON rms GET "${json}" int8_error rms ${k})
  if(rms GREATER 0.05)
    message(SEND_ERROR "8 bits are off by ${rms} of the range of output ${k}, rms")
  endif()
endforeach()

# without --int8, nothing of the earlier export stays
run(${WORK}/run --out ${WORK}/out)
if(EXISTS ${WORK}/out/flappy_policy_int8.h OR NOT EXISTS ${WORK}/out/flappy_policy.h)
  message(SEND_ERROR "another run's policy is left")
endif()
# all or nothing
file(MAKE_DIRECTORY ${WORK}/blocked/flappy_policy.h)
run(${WORK}/run --out ${WORK}/blocked)
expect_equal("stderr" "${err}" "${WORK}/blocked/flappy_policy.h: cannot be written: Is a directory\n")
file(GLOB there RELATIVE ${WORK}/blocked ${WORK}/blocked/* ${WORK}/blocked/.*)
expect_equal("files" "${there}" "flappy_policy.h")
# where there is no compiler
execute_process(COMMAND ${CMAKE_COMMAND} -E env PATH=${WORK} ${PROGRAM} ${WORK}/run --out ${WORK}/unproven --prove OUTPUT_QUIET
  ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("stderr" "${err}" "--prove: there is no compiler in PATH; accepted: a C compiler\n")
expect_equal("exit code" "${code}" 2)
file(GLOB there ${WORK}/unproven/*)
expect_equal("files" "${there}" "")
execute_process(COMMAND ${CMAKE_COMMAND} -E env PATH=${WORK} ${PROGRAM} ${WORK}/run --out ${WORK}/unproven OUTPUT_VARIABLE out
  ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("stderr" "${err}" "")
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "flappy_policy.h is not proven: cc is not in PATH; its self-test is to pass on the target\n")
file(SHA256 ${WORK}/unproven/flappy_policy.h unproven)
file(SHA256 ${WORK}/out/flappy_policy.h proven)
expect_equal("header" "${unproven}" "${proven}")

# ---- what it refuses, and leaves nothing of

function(copy_run name)
  file(REMOVE_RECURSE ${WORK}/${name})
  file(COPY ${WORK}/run/ DESTINATION ${WORK}/${name})
endfunction()
function(refused line from)
  expect_refused("${line}" ${from} --out ${WORK}/refused)
  if(EXISTS ${WORK}/refused)
    message(SEND_ERROR "left by: ${line}")
  endif()
endfunction()
function(edit file from to)
  file(READ ${file} text)
  string(REPLACE "${from}" "${to}" edited "${text}")
  if(edited STREQUAL text)
    message(SEND_ERROR "${file} has no ${from}")
  endif()
  file(WRITE ${file} "${edited}")
endfunction()
set(bad ${WORK}/bad)
set(resume "; accepted: a run that is, after flappy-train --resume ${bad}")

refused("${WORK}/nothing: is no run folder; accepted: a folder that flappy-train left" ${WORK}/nothing)
refused("${WORK}/out: is no run folder; accepted: a folder that flappy-train left" ${WORK}/out)

copy_run(bad)
file(REMOVE ${bad}/summary.json)
refused("${bad}: is not finished${resume}" ${bad})
copy_run(bad)
edit(${bad}/summary.json "\"stopped\": false" "\"stopped\": true")
refused("${bad}: is not finished: stopped at update 600${resume}" ${bad})
copy_run(bad)
edit(${bad}/run.json "\"schema\": 1" "\"schema\": 2")
file(READ ${bad}/run.json text)
string(JSON commit GET "${text}" commit)
refused("${bad}/run.json: schema 2 is read by flappy at commit ${commit}, which wrote it; accepted: schema 1" ${bad})
# a key that this program no longer knows
copy_run(bad)
edit(${bad}/run.json "\"commit\": \"${commit}\"" "\"commit\": \"0123456789ab\"")
file(APPEND ${bad}/config/fly.toml "[flown]\nbefore = 1\n")
run(${bad} --out ${WORK}/refused)
expect_match("stderr" "${err}" "flown: unknown key.*; flappy at commit 0123456789ab wrote it, and reads it\n$")
expect_equal("exit code" "${code}" 2)
# the SHA-256 that the summary holds, of what is in best.json now
function(sign_policy)
  file(READ ${WORK}/run/summary.json text)
  string(JSON old GET "${text}" policy_sha256)
  file(SHA256 ${bad}/best.json new)
  edit(${bad}/summary.json "${old}" "${new}")
endfunction()
copy_run(bad)
edit(${bad}/best.json "\"clip\":10.0" "\"clip\":9.0")
run(${bad} --out ${WORK}/refused)
expect_match("stderr" "${err}" "^${bad}/best.json: is not the policy of the run; accepted: the one with SHA-256 [0-9a-f]+, as ${bad}/summary.json says\n$")
copy_run(bad)
edit(${bad}/best.json "\"schema\":1" "\"schema\":7")
sign_policy()
refused("${bad}/best.json: schema 7 is read by a newer flappy than this one; accepted: schema 1" ${bad})
copy_run(bad)
edit(${bad}/best.json "\"task\":\"escape\"" "\"task\":\"hover\"")
sign_policy()
refused("${bad}/best.json: is of task hover; accepted: a policy of the run's task escape" ${bad})
copy_run(bad)
edit(${bad}/best.json "x_error" "x_mistake")
sign_policy()
run(${bad} --out ${WORK}/refused)
expect_match("stderr" "${err}" "actor: observes something else than task \"escape\"; accepted: x_error")
copy_run(bad)
file(READ ${bad}/best.json text LIMIT 5000)
file(WRITE ${bad}/best.json "${text}")
sign_policy()
run(${bad} --out ${WORK}/refused)
expect_match("stderr" "${err}" "^${bad}/best.json: is no JSON: [^\n]+\n$")
expect_equal("exit code" "${code}" 2)
copy_run(bad)
edit(${bad}/config/task.toml "repeat_s = 0.01" "repeat_s = 0.02")
run(${bad} --out ${WORK}/refused)
expect_match("stderr" "${err}" "^${bad}/config: is not the configuration of the run: SHA-256 [0-9a-f]+; accepted: the one with [0-9a-f]+, as ${bad}/run.json says\n$")
copy_run(bad)
file(WRITE ${WORK}/file "")
expect_refused("${WORK}/file/below: cannot be written: Not a directory" ${bad} --out ${WORK}/file/below)

# a run whose feedback controller has no C
execute_process(COMMAND ${TRAIN} ${SOURCE}/configs/train/escape.toml ${small} --set learn.updates=30 --set evaluate.every=30
  --set checkpoint.every=30 --set controller=${SOURCE}/configs/controllers/arc.toml --out ${WORK}/arc OUTPUT_QUIET)
refused("controller: is none that can be exported; accepted: kind = \"pid\"" ${WORK}/arc)

# a policy whose numbers are none
copy_run(bad)
file(READ ${bad}/best.json text)
string(REGEX REPLACE "\"weights\":\\[[^,]+," "\"weights\":[1e39," text "${text}")
file(WRITE ${bad}/best.json "${text}")
sign_policy()
refused("${bad}/best.json: has 1e+39 in it, which single precision does not hold; accepted: numbers up to 3.4e38" ${bad})

# ---- no output replaces what is read

expect_kept(${WORK}/run/best.json --json ${WORK}/run --out ${WORK}/kept)
