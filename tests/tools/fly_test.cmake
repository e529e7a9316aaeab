# flappy-fly as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-fly -DSOURCE=the project -DWORK=a folder to use -P fly_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)
set(hover ${SOURCE}/configs/fly/hover.toml)

# ---- two flights of a second: figures and logs

run(${hover} --count 2 --set flight.duration_s=1 --set flight.settle_s=0.5 --json ${WORK}/hover.json --log ${WORK}/logs)
expect_equal("stderr" "${err}" "")
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^2 flights of 1 s, task hover, seed 1, double\n")
foreach(row IN ITEMS "from 0.5 s on( +[0-9.]+)+\n" "with take-off( +[0-9.]+)+\n"
    "half of flights below( +[0-9.]+)+\n" "% below experiment( +[0-9.]+)+\n" "paper, experiment +1.76 +3.95 +5.23 +34.9 +37.2 +24.4\n" "paper, simulation +1.60 +3.86 +4.79 +36.5 +38.7 +26.9\n"
    "never farther than 0.3 m: 100.00 %; crashed: 0\n" "2 logs in " "hash [0-9a-f]+\n" "\nshown by: flappy-report ${WORK}/logs --out report.html\n$")
  expect_match("stdout" "${out}" "${row}")
endforeach()
file(READ ${WORK}/hover.json json)
set(keys crashed=NUMBER within_0p3m_fraction=NUMBER flights=NUMBER duration_s=NUMBER seed=NUMBER hash=STRING
  failures.frozen.flights=NUMBER failures.touched_ground.flights=NUMBER failures.tipped_over.flights=NUMBER
  failures.drifted_away.flights=NUMBER failures.never_took_off.flights=NUMBER failures.frozen.first_s=NULL
  wall.total_s=NUMBER wall.steps_per_s=NUMBER)
foreach(axis IN ITEMS roll_deg pitch_deg yaw_deg x_mm y_mm z_mm)
  list(APPEND keys rms_${axis}=NUMBER rms_${axis}_takeoff=NUMBER rms_${axis}_median=NUMBER rms_${axis}_p90=NUMBER)
endforeach()
expect_keys(${WORK}/hover.json ${keys})
string(JSON hash GET "${json}" hash)
foreach(text IN ITEMS fly vehicle task sensors controller)
  string(JSON actual TYPE "${json}" config ${text}.toml)
  expect_equal("text of ${text}.toml" "${actual}" STRING)
endforeach()
foreach(flight IN ITEMS 0000 0001)
  foreach(file IN ITEMS flight.toml command.csv imu.csv mocap.csv truth.csv hummingbird_identified.toml)
    if(NOT EXISTS ${WORK}/logs/${flight}/${file})
      message(SEND_ERROR "no ${flight}/${file}")
    endif()
  endforeach()
endforeach()
file(STRINGS ${WORK}/logs/0000/command.csv lines)
list(LENGTH lines count)
expect_equal("lines of command.csv" "${count}" 1001)

# the same bytes again, without logs and whatever the threads; others for another seed
run(${hover} --count 2 --set flight.duration_s=1 --set flight.threads=2 --json ${WORK}/again.json)
file(READ ${WORK}/again.json json)
string(JSON again GET "${json}" hash)
expect_equal("hash" "${again}" "${hash}")
run(${hover} --count 2 --set flight.duration_s=1 --seed 2 --json ${WORK}/seed.json)
file(READ ${WORK}/seed.json json)
string(JSON seed GET "${json}" seed)
string(JSON other GET "${json}" hash)
expect_equal("seed" "${seed}" 2)
if(other STREQUAL hash)
  message(SEND_ERROR "another seed, the same hash ${hash}")
endif()
string(JSON type TYPE "${json}" rms_x_mm)
expect_equal("figures of flights that never settled" "${type}" NULL)

# ---- Ctrl-C: what has been flown is written

find_program(TIMEOUT timeout REQUIRED)
execute_process(COMMAND ${TIMEOUT} --foreground --preserve-status -s INT 2 ${PROGRAM} ${hover} --set flight.duration_s=10000 --json ${WORK}/int.json
  OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^stopped: 1 of 1 flights, the last at [0-9.]+ s\n")
file(READ ${WORK}/int.json json)
string(JSON stopped GET "${json}" stopped)
expect_equal("stopped" "${stopped}" ON)

# ---- what is refused

expect_refused("${WORK}/none.toml: cannot be read: No such file or directory" ${WORK}/none.toml)
file(WRITE ${WORK}/bad.toml "schema = 1\nprecision = \"half\"\n")
expect_refused("${WORK}/bad.toml:2:13: precision: \"half\" is not known; accepted: \"float\", \"double\"" ${WORK}/bad.toml)
expect_refused("--set flight.durations_s=1: flight.durations_s: unknown key; accepted: control_hz, duration_s, first_flapper, seed, settle_s, step_s, support, threads; did you mean \"duration_s\"?"
  ${hover} --set flight.durations_s=1)
expect_refused("--set controller.attitude.pitch.q=1: attitude.pitch.q: unknown key; accepted: d, i, integral_limit, p"
  ${hover} --set controller.attitude.pitch.q=1)
expect_refused("${WORK}/none.json: cannot be read: No such file or directory" ${hover} --set actor=${WORK}/none.json)
expect_refused("flappy-fly: --count: Value 0 not in range 1 to 1000000; see flappy-fly --help" ${hover} --count 0)
expect_refused("flappy-fly: config is required; see flappy-fly --help")
expect_refused("${WORK}/bad.toml: is no folder; accepted: a new folder, an empty one, or logs of as many flights to replace"
  ${hover} --log ${WORK}/bad.toml)
expect_refused("${WORK}/logs: holds 0000; accepted: a new folder, an empty one, or logs of as many flights to replace"
  ${hover} --log ${WORK}/logs)

# ---- no output replaces what is read, named on the command line or by the configuration

file(COPY ${SOURCE}/configs/fly ${SOURCE}/configs/vehicles ${SOURCE}/configs/tasks ${SOURCE}/configs/sensors ${SOURCE}/configs/controllers
  ${SOURCE}/configs/randomisation DESTINATION ${WORK}/configs)
set(own ${WORK}/configs/fly/hover.toml)
foreach(file IN ITEMS fly/hover.toml vehicles/hummingbird_identified.toml tasks/hover.toml)
  foreach(option IN ITEMS --json --mcap --progress)
    expect_kept(${WORK}/configs/${file} ${option} ${own} --count 1 --set flight.duration_s=0.1)
  endforeach()
endforeach()
