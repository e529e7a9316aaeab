# flappy-gap as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-gap -DSOURCE=the project -DWORK=a folder to use -P gap_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

function(expect_line text)
  string(FIND "${out}" "${text}\n" at)
  if(at EQUAL -1)
    message(SEND_ERROR "no line \"${text}\" in\n${out}")
  endif()
endfunction()

# Standing still, in `folder`, with this gravity in the accelerometer, for so many intervals of 20 ms.
function(write_flight folder gravity intervals)
  file(WRITE ${folder}/flight.toml
    "schema = 1\nvehicle = \"bird.toml\"\nflapping_Hz = 10\ngravity_m_s2 = 9.81\n"
    "[ambient]\nair_density_kg_m3 = 1.18\nground_z_m = 0\nceiling_z_m = 3\nwalls = []\n"
    "[mocap]\nrate_hz = 50\nlatency_s = 0\nposition_noise_m = 0\nattitude_noise_rad = 1e-3\n"
    "[imu]\nrate_hz = 50\nlatency_s = 0\nbandwidth_hz = 20\nposition_m = [0, 0, 0]\n"
    "gyro_noise_rad_s = 0\ngyro_bias_sd_rad_s = [0.01, 0.01, 0.01]\naccel_noise_m_s2 = 0\n")
  set(command "t_s,left_voltage_V,right_voltage_V\n")
  set(mocap "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n")
  set(imu "t_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2\n")
  foreach(i RANGE ${intervals})
    math(EXPR ms "1000 + 20 * ${i}")
    string(REGEX REPLACE "(...)$" ".\\1" t "${ms}")
    math(EXPR phase "${i} % 5")
    list(GET volts ${phase} volt)
    string(APPEND command "${t},${volt},${volt}\n")
    string(APPEND mocap "${t},0,0,0.1,1,0,0,0\n")
    string(APPEND imu "${t},0,0,0,0,0,${gravity}\n")
  endforeach()
  file(WRITE ${folder}/command.csv "${command}")
  file(WRITE ${folder}/mocap.csv "${mocap}")
  file(WRITE ${folder}/imu.csv "${imu}")
endfunction()
set(volts 9 2.8 -7.3 -7.3 2.8)

# ---- what is read

write_flight(${WORK}/good 9.81 150)
write_flight(${WORK}/bad 0 150)
run(check ${WORK}/good)
expect_equal("stderr" "${err}" "")
expect_equal("exit code where a fault forbids a diagnosis" "${code}" 1)
expect_line("${WORK}/good: bird.toml, 10 Hz")
expect_line("  imu            151     3.000     50.00     50.00        20.00         0  0.00 %      0.000")
expect_line("  command        151     3.000     50.00         -        20.00         -       -      0.000")
expect_line("  clock              not tested: too little rotation")
expect_line("  accelerometer      ok: mean specific force (0.00, 0.00, 9.81) m/s^2 in W")
expect_line("  flapping frequency ok: voltages beat at 10 Hz, 10 Hz declared")
expect_line("  forbids a diagnosis: ${WORK}/good/command.csv:152: the flight lasts 3 s, at least 6 s (60 beats) are needed")
expect_line("1 readable, faults 1, warnings 0, not tested 4")

run(check ${WORK}/good ${WORK}/bad --json ${WORK}/out.json)
expect_equal("exit code" "${code}" 1)
expect_line("  accelerometer      warning: mean specific force (0.00, 0.00, 0.00) m/s^2 in W, (0, 0, 9.81) +- 3.0 expected: gravity is missing: acceleration instead of specific force")
expect_line("2 readable, faults 2, warnings 1, not tested 8")
file(READ ${WORK}/out.json json)
foreach(pair IN ITEMS "faults=2" "warnings=1" "not_tested=8" "flights 0 warnings=0" "flights 1 warnings=1" "flights 1 folder=${WORK}/bad"
    "flights 0 vehicle=bird.toml" "flights 0 streams 1 name=mocap" "flights 0 streams 1 samples=151" "flights 0 streams 1 declared_hz=50.0"
    "flights 0 streams 1 missing=0" "flights 0 streams 0 declared_hz=" "flights 0 findings 0 verdict=ok" "flights 0 data_faults 0 line=152")
  string(REGEX MATCH "^([^=]*)=(.*)$" matched "${pair}")
  string(REPLACE " " ";" keys "${CMAKE_MATCH_1}")
  set(expected "${CMAKE_MATCH_2}")
  string(JSON actual GET "${json}" ${keys})
  expect_equal("${keys}" "${actual}" "${expected}")
endforeach()

# Truth is there to be judged against, not to be read.
file(WRITE ${WORK}/good/truth.csv "no table")
run(check ${WORK}/good)
expect_equal("stderr beside a truth" "${err}" "")

run(--help)
expect_equal("exit code" "${code}" 0)
if(NOT out MATCHES "check +axes, units, clocks and dropouts")
  message(SEND_ERROR "--help does not tell of check: ${out}")
endif()

# A stream that is declared and not there is done without; nothing forbids a diagnosis of a flight that is long enough.
write_flight(${WORK}/long 9.81 350)
file(APPEND ${WORK}/long/flight.toml "[wings]\nrate_hz = 500\nnoise_rad = 0.01\n")
run(check ${WORK}/long)
expect_equal("stderr" "${err}" "warning: ${WORK}/long/flight.toml: wings: is declared, but there is no wings.csv: done without\n")
expect_match("stdout" "${out}" "1 readable, faults 0, ")
expect_equal("exit code" "${code}" 0)

# ---- what is refused

expect_refused("${WORK}/none: cannot be read: No such file or directory" check ${WORK}/none)
expect_refused("${WORK}/none: cannot be read: No such file or directory" check ${WORK}/good ${WORK}/none)
expect_refused("${WORK}/good/imu.csv: cannot be read: Not a directory" check ${WORK}/good/imu.csv)
expect_refused("${WORK}/good/.: is given twice; accepted: each flight once" check ${WORK}/good ${WORK}/bad ${WORK}/good/.)
file(APPEND ${WORK}/bad/imu.csv "4.0,0,0,0,0,0,9.81\n")
expect_refused("${WORK}/bad/imu.csv:153: t_s: 4 does not come after 4 of the line before; accepted: times that increase"
  check ${WORK}/good ${WORK}/bad)
file(WRITE ${WORK}/bad/mocap.csv "t_s,x_mm,y_m,z_m,qw,qx,qy,qz\n")
expect_refused("${WORK}/bad/mocap.csv:1: x_mm: unknown column; accepted here with another unit: \"x_m\"" check ${WORK}/bad)
file(REMOVE ${WORK}/bad/flight.toml)
expect_refused("${WORK}/bad/flight.toml: cannot be read: No such file or directory" check ${WORK}/bad)
expect_refused("--magnitude wind: no factor; accepted: EFFECT=FACTOR, as wind=2" plan
  --vehicle ${SOURCE}/configs/vehicles/hummingbird_nominal.toml --magnitude wind)
expect_refused("flappy-gap: A subcommand is required; accepted: check, import, diagnose, mcap, plan, learn-discrepancy, learn-sessions, effects; see flappy-gap --help")
expect_refused("flappy-gap: diagnos: no such command; accepted: check, import, diagnose, mcap, plan, learn-discrepancy, learn-sessions, effects; did you mean \"diagnose\"?; see flappy-gap --help" diagnos)
expect_refused("flappy-gap: flight is required; see flappy-gap --help" check)
set(diagnose diagnose --vehicle ${SOURCE}/configs/vehicles/hummingbird_nominal.toml --priors ${SOURCE}/configs/gap/priors.toml
  --flights ${WORK}/good)
expect_refused("--withhold gale: no such effect; accepted: those that flappy-gap effects lists" ${diagnose} --withhold gale)
expect_refused("${WORK}/good/imu.csv: cannot be written: Not a directory" ${diagnose} --out ${WORK}/good/imu.csv)

expect_refused("--robots crazyflie.toml: accepted: VEHICLE.toml:DIR, with more folders as VEHICLE.toml:DIR:DIR"
  learn-sessions --robots crazyflie.toml --out ${WORK}/scatter.toml)
expect_refused("${WORK}/bad: no flight; accepted: a folder of flight logs"
  learn-sessions --robots ${SOURCE}/configs/vehicles/crazyflie.toml:${WORK}/bad --out ${WORK}/scatter.toml)
set(learn learn-discrepancy --vehicle ${SOURCE}/configs/vehicles/hummingbird_nominal.toml --out ${WORK}/learnt.toml --robots)
expect_refused("${WORK}/bad: no flight; accepted: a folder of flight logs" ${learn} ${WORK}/bad)
expect_refused("${WORK}/good/command.csv:152: the flight lasts 3 s, at least 6 s (60 beats) are needed; accepted: flights that flappy-gap check finds no fault in"
  ${learn} ${WORK}/good)

# ---- data that forbid a diagnosis are a result; nothing of an earlier one stays beside it

file(WRITE ${WORK}/diagnosis/vehicle_corrected.toml "of another flight")
run(${diagnose} --out ${WORK}/diagnosis --json ${WORK}/faulty.json)
expect_equal("exit code" "${code}" 1)
expect_keys(${WORK}/faulty.json "verdict.kind=STRING")
expect_line("The data are at fault; nothing was diagnosed")
expect_line("  ${WORK}/good/command.csv:152: the flight lasts 3 s, at least 6 s (60 beats) are needed")
file(READ ${WORK}/diagnosis/diagnosis.json json)
string(JSON kind GET "${json}" verdict kind)
expect_equal("verdict" "${kind}" data)
if(EXISTS ${WORK}/diagnosis/vehicle_corrected.toml)
  message(SEND_ERROR "a corrected vehicle of another diagnosis stays")
endif()

# ---- a diagnosis for viewers, which the tests of its command have

expect_refused("${WORK}/good: has no diagnosis.json; accepted: the folder of a finished flappy-gap diagnose --out"
  mcap ${WORK}/good --vehicle ${SOURCE}/configs/vehicles/hummingbird_nominal.toml --diagnosis ${WORK}/good --out ${WORK}/good.mcap)

# ---- no output replaces what is read

foreach(file IN ITEMS flight.toml imu.csv)
  expect_kept(${WORK}/good/${file} --json check ${WORK}/good)
  expect_kept(${WORK}/good/${file} --json ${diagnose})
endforeach()
