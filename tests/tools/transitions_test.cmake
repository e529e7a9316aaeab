# flappy-identify transitions as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-identify -DFLY=flappy-fly -DSOURCE=the project -DWORK=a folder to use -P transitions_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

set(vehicles ${SOURCE}/configs/vehicles)
execute_process(COMMAND ${FLY} ${SOURCE}/configs/fly/hover.toml --set flight.duration_s=4 --count 2 --log ${WORK}/flights
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
set(flights ${WORK}/flights/0000 ${WORK}/flights/0001)

# ---- the table, JSON and CSV

run(transitions ${flights} --samples 100 --json ${WORK}/t.json --csv ${WORK}/t.csv)
expect_equal("exit code" "${code}" 0)
expect_equal("stderr" "${err}" "")
expect_match("the first line" "${out}" "^2 flights, 100 samples replayed of 1198 \\([0-9]+ too low, [0-9]+ where streams are missing\\), 0 diverged")
expect_match("the table" "${out}" "\n  pitch +2\\.[0-9]+ deg ")
expect_match("the paper" "${out}" "\n  paper +after one beat under 5 %")
expect_match("the windows" "${out}" "\none beat is 30.0 ms, two are 58.0: whole intervals of the IMU\n")
set(keys samples=NUMBER diverged=NUMBER wall_s=NUMBER beat_s=NUMBER two_beats_s=NUMBER normalised_innovation=NUMBER
  error_1beat.unit=STRING absolute_1beat.unit=STRING)
foreach(state IN ITEMS x_m y_m z_m roll_rad pitch_rad yaw_rad vx_m_s vy_m_s vz_m_s wx_rad_s wy_rad_s wz_rad_s)
  list(APPEND keys error_1beat.${state}=NUMBER error_2beats.${state}=NUMBER)
endforeach()
expect_keys(${WORK}/t.json ${keys})
file(READ ${WORK}/t.json json)
string(JSON pitch GET "${json}" error_1beat pitch_rad)
if(pitch GREATER 0.06 OR pitch LESS 0.01)
  message(SEND_ERROR "error_1beat.pitch_rad is ${pitch}")
endif()
file(STRINGS ${WORK}/t.csv lines)
list(LENGTH lines count)
expect_equal("lines of the CSV" ${count} 41)

run(transitions ${flights} --every 50 --truth)
expect_match("truth says so" "${out}" "from truth.csv: what is left is the vehicle's error alone\n")
expect_match("nothing is left" "${out}" "\n  pitch[^\n]* 0\\.000 +0\\.000 +0\\.0 % +0\\.0 % +0\\.000 +0\\.000 +0\\.0 % +0\\.0 %\n")

# ---- what is refused

expect_refused("${WORK}/none: cannot be read: No such file or directory" transitions ${WORK}/none)
expect_refused("${WORK}/none/t.csv: cannot be written: No such file or directory"
  transitions ${WORK}/gone --csv ${WORK}/none/t.csv)
expect_refused("${WORK}/flights/../flights/0000/: is given twice; accepted: each flight once"
  transitions ${flights} ${WORK}/flights/../flights/0000/)
foreach(flight IN LISTS flights)  # or beside them
  file(RENAME ${flight}/hummingbird_identified.toml ${WORK}/flights/hummingbird_identified.toml)
endforeach()
run(transitions ${flights} --every 50 --accept-innovation)
expect_match("the normalised innovation" "${out}" "\nmotion capture and IMU disagree by up to 1\\.[0-9] times their declared noise\n")
file(WRITE ${WORK}/flights/hummingbird_identified.toml "schema = 1\n")
expect_refused("${WORK}/flights/0000/../hummingbird_identified.toml: is not the file that ${WORK}/flights/0000 was flown with (SHA-256); accepted: that file, or any by --vehicle"
  transitions ${flights})
file(REMOVE ${WORK}/flights/hummingbird_identified.toml)
expect_refused("${WORK}/flights/0000: its vehicle hummingbird_identified.toml is neither in it nor next to it; accepted: one of these, or --vehicle"
  transitions ${flights})
run(transitions ${flights} --vehicle ${vehicles}/hummingbird_nominal.toml --every 50)
expect_equal("another vehicle" "${code}" 0)
file(REMOVE ${WORK}/flights/0001/imu.csv)
expect_refused("${WORK}/flights/0001/imu.csv: is missing; accepted: a folder with flight.toml, command.csv, mocap.csv and imu.csv"
  transitions ${flights} --vehicle ${vehicles}/hummingbird_identified.toml)
run(transitions ${flights} --every 0)
expect_equal("--every 0" "${code}" 2)
run(transitions ${flights} --every 2 --samples 3)
expect_equal("--every and --samples" "${code}" 2)
