# flappy-identify as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-identify -DSOURCE=the project -DWORK=a folder to use -P identify_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)
set(nominal ${SOURCE}/configs/vehicles/hummingbird_nominal.toml)
set(identified ${SOURCE}/configs/vehicles/hummingbird_identified.toml)

# ---- forces: measure one vehicle, fit another to it, and fly what comes out

run(simulate-forces --vehicle ${identified} --out ${WORK}/map.csv --seed 3)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^hummingbird_identified: 37 inputs, mean over 17 beats \\(0.5 s\\), sensor nano17\n$")
file(STRINGS ${WORK}/map.csv rows)
list(LENGTH rows count)
expect_equal("rows of the map" "${count}" 38)
run(simulate-forces --vehicle ${identified} --out ${WORK}/held.csv --inputs ${SOURCE}/configs/identify/held_out_inputs.csv --seed 4)
expect_equal("exit code" "${code}" 0)

set(runs 1)
if(DEFINED ENV{FLAPPY_FULL_TESTS})  # seconds
  list(APPEND runs 2)
endif()
foreach(i IN LISTS runs)
  run(forces ${WORK}/map.csv --vehicle ${nominal} --out ${WORK}/fitted${i}.toml --held-out ${WORK}/held.csv --starts 1
    --threads ${i} --json ${WORK}/fit${i}.json)
  expect_equal("exit code" "${code}" 0)
  file(READ ${WORK}/fitted${i}.toml fitted${i})
endforeach()
if(DEFINED fitted2)
  expect_equal("a second run, on other threads" "${fitted2}" "${fitted1}")
endif()
expect_match("stdout" "${out}" "\n37 inputs, total error 33\\.[0-9]+ % before, 0\\.[0-9]+ % after, 0\\.[0-9]+ % on 16 held-out inputs\n")
string(REGEX MATCHALL "\n" lines "${out}")
list(LENGTH lines lines)
if(lines GREATER 40)
  message(SEND_ERROR "the report has ${lines} lines")
endif()
file(SHA256 ${WORK}/map.csv sha256)
expect_match("the fitted vehicle" "${fitted1}" "^# Fitted to a measured force map by flappy-identify, commit [0-9a-z-]+, method gn\n# from vehicle hummingbird_nominal\n# measured file's sha256 ${sha256}\n# total error 33")
file(SHA256 ${SOURCE}/configs/identify/forces.toml sha256)
expect_match("the fitted vehicle" "${fitted1}" "\n# torques about 0,0,0, 0 rows held out, 0 left out for jumps\n# configuration's sha256 ${sha256}\n# seed 1, 1 of 1 starts agree\n# parameters fitted:\n#   left.motor.resistance_ohm\n")
expect_match("one start alone" "${out}" "95 % interval, of one optimum: no second start found it\n")
expect_keys(${WORK}/fit1.json total_error_before=NUMBER total_error_after=NUMBER heldout_error=NUMBER parameters=ARRAY
  parameters.0.name=STRING parameters.0.value=NUMBER parameters.0.low=NUMBER parameters.0.high=NUMBER
  parameters.0.seen=BOOLEAN parameters.11.name=STRING wall_s=NUMBER
  left_out=ARRAY jumping_kept=ARRAY signs_unchecked=ARRAY intervals_confirmed=BOOLEAN ends.0.cost=NUMBER)
run(simulate-forces --vehicle ${WORK}/fitted1.toml --out ${WORK}/again.csv --noise none)
expect_equal("measuring the fitted vehicle" "${code}" 0)

# without declared noise, with rows of its own held out, by another method, for few parameters
file(STRINGS ${WORK}/map.csv rows)
set(plain "")
foreach(row IN LISTS rows)
  string(REPLACE "," ";" cells "${row}")
  list(SUBLIST cells 0 10 cells)
  string(REPLACE ";" "," row "${cells}")
  string(APPEND plain "${row}\n")
endforeach()
file(WRITE ${WORK}/plain.csv "${plain}")
run(forces ${WORK}/plain.csv --vehicle ${identified} --out ${WORK}/few.toml --hold-out 5 --method cmaes --population 8
  --generations 3 --parameters left.motor.resistance_ohm,right.motor.resistance_ohm)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "CMA-ES +32 maps.*\n32 inputs, total error 0\\.[0-9]+ % before, 0\\.[0-9]+ % after, 0\\.[0-9]+ % on 5 held-out inputs\nmisfit [0-9.]+ of the estimated noise\n")

if(DEFINED ENV{FLAPPY_FULL_TESTS})  # seconds
  run(calibrate --vehicle ${nominal} --truth ${identified} --seeds 1 --json ${WORK}/calibration.json)
  expect_match("calibration" "${out}" "\n1 noise seeds: 12 of 12 inside their 95 % intervals, ")
endif()
run(calibrate --vehicle ${nominal} --truth ${identified} --seeds 1 --inputs ${SOURCE}/configs/identify/held_out_inputs.csv
  --json ${WORK}/calibration.json --parameters left.motor.resistance_ohm)
expect_match("calibration on other inputs" "${out}" "\n1 noise seeds: [01] of 1 inside ")
expect_keys(${WORK}/calibration.json coverage_percent=NUMBER parameters=ARRAY)
file(READ ${WORK}/calibration.json json)
string(JSON inputs GET "${json}" inputs)
expect_equal("inputs" "${inputs}" 16)

# ---- compare-map

run(compare-map --vehicle ${identified} --json ${WORK}/compare.json)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "\nyaw +0\\.0033[45][0-9]* +0\\.00184 +1\\.8[12][0-9] ")
expect_keys(${WORK}/compare.json lines.thrust.slope=NUMBER lines.yaw.slope_ratio=NUMBER)

# ---- kinematics: what one run draws is measured by the next

file(WRITE ${WORK}/still.csv "t_s,left_stroke_rad,left_rotation_rad,right_stroke_rad,right_rotation_rad\n")
foreach(i RANGE 0 99)
  file(APPEND ${WORK}/still.csv "${i}e-3,0.1,0.2,0.3,0.4\n")
endforeach()
run(kinematics ${WORK}/still.csv --vehicle ${identified} --amplitude 10 --csv ${WORK}/beat.csv --json ${WORK}/wings.json)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "\nleft_stroke +0\\.00 +61\\.[0-9]+ +5\\.73 +3\\.[0-9]+ ")
expect_keys(${WORK}/wings.json shift_rad=NUMBER angles.left_stroke_rad.rms_rad=NUMBER
  angles.right_rotation_rad.simulated.amplitude_rad=NUMBER)
file(STRINGS ${WORK}/beat.csv rows)
list(LENGTH rows count)
expect_equal("points of the beat" "${count}" 201)

# ---- refusals

expect_refused("${WORK}/map.csv:2: is line 2 of ${WORK}/map.csv; accepted: measurements that are not fitted"
  forces ${WORK}/map.csv --vehicle ${nominal} --out ${WORK}/out.toml --held-out ${WORK}/map.csv)
file(CREATE_LINK map.csv ${WORK}/link.csv SYMBOLIC)
expect_refused("${WORK}/link.csv: is read by the same command; accepted: another file"
  forces ${WORK}/map.csv --vehicle ${nominal} --out ${WORK}/link.csv)
file(READ ${nominal} fast)
file(WRITE ${WORK}/slow.toml "${fast}")
expect_refused("${WORK}/slow.toml: is read by the same command; accepted: another file"
  simulate-forces --vehicle ${WORK}/slow.toml --out ${WORK}/slow.toml)
string(REPLACE "hold_s = 1e-3" "hold_s = 2.5e-4" fast "${fast}")
file(WRITE ${WORK}/fast.toml "${fast}")
run(simulate-forces --vehicle ${WORK}/fast.toml --out ${WORK}/out.csv)
expect_match("stderr" "${err}" "fast.toml:[0-9:]+ driver.hold_s: physics goes by steps of 1e-04 s here; accepted: a multiple of that")
expect_refused("flappy-identify: --seed: Value -1 is below 0; see flappy-identify --help"
  simulate-forces --vehicle ${identified} --out ${WORK}/out.csv --seed -1)

expect_refused("${WORK}/gone.csv: cannot be read: No such file or directory"
  forces ${WORK}/gone.csv --vehicle ${nominal} --out ${WORK}/out.toml)
file(READ ${WORK}/map.csv map)
string(REPLACE "torque_y_Nm" "torque_y_mNm" wrong "${map}")
file(WRITE ${WORK}/wrong.csv "${wrong}")
expect_refused("${WORK}/wrong.csv:1: torque_y_mNm: wrong unit mNm, expected Nm; accepted: torque_y_Nm"
  forces ${WORK}/wrong.csv --vehicle ${nominal} --out ${WORK}/out.toml)
file(STRINGS ${WORK}/plain.csv rows LIMIT_COUNT 11)
string(REPLACE ";" "\n" few "${rows}")
file(WRITE ${WORK}/few.csv "${few}\n")
expect_refused("${WORK}/few.csv: has 10 inputs for 12 parameters; accepted: at least as many inputs as parameters"
  forces ${WORK}/few.csv --vehicle ${nominal} --out ${WORK}/out.toml)
expect_refused("--moment-point: \"1,2\" is no point; accepted: x,y,z, three numbers of metres from -1 to 1, or com"
  forces ${WORK}/map.csv --vehicle ${nominal} --out ${WORK}/out.toml --moment-point 1,2)
expect_refused("--parameters: \"left.motor.resistance\" is not fitted by ${SOURCE}/configs/identify/forces.toml; accepted: names of its parameters; did you mean \"left.motor.resistance_ohm\"?"
  forces ${WORK}/map.csv --vehicle ${nominal} --out ${WORK}/out.toml --parameters left.motor.resistance)
expect_refused("${WORK}/still.csv: amplitude_V: column is missing; accepted: this column, or --amplitude"
  kinematics ${WORK}/still.csv --vehicle ${nominal})
expect_refused("--from-s: is not before --to-s; accepted: a time before it"
  kinematics ${WORK}/still.csv --vehicle ${nominal} --amplitude 10 --from-s 2 --to-s 1)
expect_refused("flappy-identify: --from-s: Value nan is not finite; see flappy-identify --help"
  kinematics ${WORK}/still.csv --vehicle ${nominal} --amplitude 10 --from-s nan)
expect_refused("${WORK}/none/beat.svg: cannot be written: No such file or directory"
  kinematics ${WORK}/still.csv --vehicle ${nominal} --amplitude 10 --csv ${WORK}/none.csv --svg ${WORK}/none/beat.svg)
foreach(value IN ITEMS 100 -5)
  expect_refused("command line: amplitude_V: ${value} is beyond the vehicle's limits; accepted: 0 to 18"
    kinematics ${WORK}/still.csv --vehicle ${nominal} --amplitude ${value})
endforeach()
expect_refused("command line: split_cycle: 3 is beyond the vehicle's limits; accepted: -0.15 to 0.15"
  kinematics ${WORK}/still.csv --vehicle ${nominal} --amplitude 10 --split-cycle 3)
file(STRINGS ${WORK}/still.csv rows)
list(TRANSFORM rows APPEND ",19")
list(POP_FRONT rows)
list(JOIN rows "\n" rows)
file(WRITE ${WORK}/high.csv "t_s,left_stroke_rad,left_rotation_rad,right_stroke_rad,right_rotation_rad,amplitude_V\n${rows}\n")
expect_refused("${WORK}/high.csv: amplitude_V: 19 is beyond the vehicle's limits; accepted: 0 to 18"
  kinematics ${WORK}/high.csv --vehicle ${nominal})
foreach(left IN ITEMS out.toml out.csv none.csv)
  if(EXISTS ${WORK}/${left})
    message(SEND_ERROR "a refused run left ${left}")
  endif()
endforeach()

# ---- transitions

# ---- gait

file(WRITE ${WORK}/gait.csv "t_s,stroke_deg\n0,60\n0.01,0\n0.02,-60\n0.03,0\n")
run(gait ${WORK}/gait.csv --frequency-Hz 25 --harmonics 1)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^\\[left\\.stroke\\]\nmode = \"driven\"\nmean_rad = -?0\\.0\ncos_rad = \\[1\\.0471976\\]\nsin_rad = \\[-?0\\.0\\]\n")
run(gait ${WORK}/gait.csv --frequency-Hz 25 --harmonics 1 --out ${WORK}/gait.toml --json ${WORK}/gait.json)
expect_match("stdout" "${out}" "^left\\.stroke: mean -?0\\.00 deg, first harmonic 60\\.00 deg, 0\\.000 deg rms left\n$")
expect_keys(${WORK}/gait.json angles.0.angle=STRING angles.0.cos_rad=ARRAY)
expect_refused("${WORK}/gait.csv: a gap of 0.25 beats from 0 of the beat on; accepted: at most 0.0625 beats for 8 harmonics, or fewer of them"
  gait ${WORK}/gait.csv --frequency-Hz 25)

# ---- no output replaces what is read

expect_kept(${WORK}/map.csv --json forces ${WORK}/map.csv --vehicle ${nominal} --out ${WORK}/kept.toml)
expect_kept(${WORK}/slow.toml --json simulate-forces --vehicle ${WORK}/slow.toml --out ${WORK}/kept.csv)
