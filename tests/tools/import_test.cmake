# flappy-gap import as a person meets it, and flappy-fly --mcap before it.
#   cmake -DPROGRAM=flappy-gap -DFLY=flappy-fly -DSOURCE=the project -DWORK=a folder to use -P import_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)
set(mapping ${SOURCE}/configs/mapping/ros2.toml)

# ---- a flight as topics, and as a log again

execute_process(COMMAND ${FLY} ${SOURCE}/configs/fly/open_loop.toml --set flight.duration_s=0.5 --log ${WORK}/log --mcap ${WORK}/f.mcap
  OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
expect_equal("stderr" "${err}" "")
expect_match("stdout" "${out}" "  topics in ${WORK}/f.mcap\n")
run(import ${WORK}/f.mcap --mapping ${mapping} --out ${WORK}/imported --set start=clock --set vehicle=bird.toml --json ${WORK}/import.json)
expect_equal("stderr" "${err}" "")
expect_equal("exit code" "${code}" 0)
expect_match("stdout" "${out}" "^${WORK}/imported: bird.toml, 34 Hz\n  stream +samples +Hz +never +twice +late +order +unusable")
expect_match("stdout" "${out}" "\n  command +500 +1000.00 +0 +0 +0 +0 +0 +0.000 +0.000  /wing_input\n")
expect_match("stdout" "${out}" "\n  mocap +7[0-9] +150.0[0-9] +0 +0 +0 +0 +0 +30.000 +30.000  /pose\n")
expect_match("stdout" "${out}" "\n  clock robot: the receiver's is ahead by 0.000000 s, drifting by 0.0 us/s, by [0-9]+ stamps over 0.5 s\n$")
expect_keys(${WORK}/import.json folder=STRING start_ns=NUMBER warnings=ARRAY streams.0.samples=NUMBER streams.4.name=STRING
  streams.1.delay_median_s=NUMBER clocks.0.offset_s=NUMBER clocks.0.measured=BOOLEAN)
foreach(file IN ITEMS command wings)  # no latency there, so the same to the last digit
  file(READ ${WORK}/log/${file}.csv flown)
  file(READ ${WORK}/imported/${file}.csv imported)
  expect_equal("${file}.csv" "${imported}" "${flown}")
endforeach()
run(check ${WORK}/imported)
expect_match("stdout of the check" "${out}" "1 readable, ")

# ---- a flight without power and wings

execute_process(COMMAND ${FLY} ${SOURCE}/configs/fly/hover.toml --set flight.duration_s=0.5 --mcap ${WORK}/hover.mcap OUTPUT_QUIET)
run(import ${WORK}/hover.mcap --mapping ${mapping} --out ${WORK}/hover)
expect_equal("stderr" "${err}" "warning: ${mapping}: power: /battery is not recorded: done without
warning: ${mapping}: wings: /joint_states is not recorded: done without\n")

# ---- tables

file(MAKE_DIRECTORY ${WORK}/tables)
file(WRITE ${WORK}/tables/motors.csv "time_us,left_V,right_V\n0,1,2\n10000,1,2\n")
file(WRITE ${WORK}/tables/mocap.csv "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,1000,2,3,1,0,0,0\n0.01,1,2,3,1,0,0,0\n")
file(WRITE ${WORK}/tables/imu.csv "time_us,gx_deg_s,gy_deg_s,gz_deg_s,ax_g,ay_g,az_g\n0,180,0,0,0,0,1\n10000,0,0,0,0,0,1\n")
set(tables ${WORK}/tables/motors.csv ${WORK}/tables/mocap.csv ${WORK}/tables/imu.csv)
run(import ${tables} --mapping ${SOURCE}/configs/mapping/csv.toml --out ${WORK}/of_tables)
expect_equal("stderr" "${err}" "")
file(READ ${WORK}/of_tables/mocap.csv mocap)
expect_equal("mocap.csv" "${mocap}" "t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,1,0.002,0.003,1,0,0,0\n0.01,0.001,0.002,0.003,1,0,0,0\n")

# ---- an export of motion capture, with the mapping that is shipped; y up in mm

set(commands "time_us,m1,m2,m3,m4\n")
set(take "Format Version,1.23,Take Name,hover,Export Frame Rate,100.000000,Rotation Type,Quaternion,Length Units,Millimeters\n\n,Type")
foreach(row IN ITEMS "Rigid Body" "\n,Name" robot "\n,ID" 1 "\n,")
  if(row MATCHES "\n")
    string(APPEND take "${row}")
  else()
    string(REPEAT ",${row}" 7 cells)
    string(APPEND take "${cells}")
  endif()
endforeach()
string(APPEND take ",Rotation,Rotation,Rotation,Rotation,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z\n")
foreach(i RANGE 9)
  string(APPEND commands "${i}0000,1,1,1,1\n")
  string(APPEND take "${i},0.0${i},0,0,0,1,100${i},2000,3000\n")
endforeach()
file(WRITE ${WORK}/export/motors.csv "${commands}")
file(WRITE ${WORK}/export/take.csv "${take}")
set(export import ${WORK}/export/motors.csv ${WORK}/export/take.csv --mapping ${SOURCE}/configs/mapping/motion_capture.toml)
run(${export} --out ${WORK}/of_export)
expect_equal("stderr" "${err}" "")
file(READ ${WORK}/of_export/mocap.csv mocap)
expect_match("mocap.csv" "${mocap}" "^t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,1,-3,2,1[.0-9]*,0,0,0\n0.01,1.001[0-9]*,-3,2,1")  # 1 but for rounding
expect_refused("--set mocap.body=box: mocap.body: \"box\" is no rigid body of the recording; accepted: robot"
  ${export} --out ${WORK}/refused --set mocap.body=box)

# ---- the same of QTM and Vicon, by the commands of docs/reference/import.md

string(JOIN "\t" names Frame Time "robot X" Y Z Roll Pitch Yaw Residual "Rot[0]" "Rot[1]" "Rot[2]" "Rot[3]" "Rot[4]" "Rot[5]" "Rot[6]" "Rot[7]" "Rot[8]")
set(qtm "NO_OF_FRAMES\t10\nFREQUENCY\t100\nDATA_INCLUDED\t6D\nBODY_NAMES\trobot\n${names}\n")
set(vicon "Objects\n100\n,,Global Angle (Quaternion) robot:robot,,,,,,\nFrame,Sub Frame,RX,RY,RZ,RW,TX,TY,TZ\n,,,,,,mm,mm,mm\n")
foreach(i RANGE 9)
  math(EXPR frame "${i} + 1")
  string(APPEND qtm "${frame}\t0.0${i}000\t100${i}.000\t-3000.000\t2000.000\t0\t0\t0\t0.4\t1\t0\t0\t0\t1\t0\t0\t0\t1\t\n")
  string(APPEND vicon "${frame},0,0,0,0,1,100${i},-3000,2000\n")
endforeach()
foreach(kind IN ITEMS qtm vicon)
  set(take ${WORK}/${kind}/take.csv)
  if(kind STREQUAL qtm)
    set(take ${WORK}/${kind}/take.tsv)
  endif()
  file(WRITE ${take} "${${kind}}")
  run(import ${WORK}/export/motors.csv ${take} --mapping ${SOURCE}/configs/mapping/motion_capture.toml
    --set mocap.world=enu --set mocap.frame=flu --out ${WORK}/of_${kind})
  expect_equal("stderr of ${kind}" "${err}" "")
  file(READ ${WORK}/of_${kind}/mocap.csv mocap)
  expect_match("mocap.csv of ${kind}" "${mocap}" "^t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,1,-3,2,1,0,0,0\n0.01,1.001[0-9]*,-3,2,1,0,0,0\n")
endforeach()

# ---- one sample from before its clock was there: the flight is the others, and every program ends

file(WRITE ${WORK}/zero/mapping.toml "schema = 1
vehicle = \"flapper_nimble.toml\"
gravity_m_s2 = 9.81
ambient = { air_density_kg_m3 = 1.2, ground_z_m = -1000.0, ceiling_z_m = 1000.0, walls = [] }
[command]
channel = \"*\"
time = \"field\"
time_field = \"t\"
inputs = [\"u\"]
columns = { u = \"u\" }
[mocap]
channel = \"*\"
time = \"field\"
time_field = \"t\"
latency_s = 0.0
position_noise_m = 1e-4
attitude_noise_rad = 5e-3
columns = { x_m = \"x\", y_m = \"y\", z_m = \"z\", qw = \"qw\", qx = \"qx\", qy = \"qy\", qz = \"qz\" }
")
set(rows "t,u,x,y,z,qw,qx,qy,qz\n0,9,0.1,0.2,1,1,0,0,0\n")
foreach(i RANGE 100 499)
  string(APPEND rows "1700000000.${i},9.${i},0.${i},0.2,1,1,0,0,0\n")
endforeach()
file(WRITE ${WORK}/zero/log.csv "${rows}")
run(import ${WORK}/zero/log.csv --mapping ${WORK}/zero/mapping.toml --out ${WORK}/of_zero)
expect_equal("stderr" "${err}" "warning: ${WORK}/zero/mapping.toml: command: 1 samples are unusable: 1 apart from the rest of the recording
warning: ${WORK}/zero/mapping.toml: mocap: 1 samples are unusable: 1 apart from the rest of the recording\n")
expect_match("stdout" "${out}" "\n  command +400 +1000.00 +0 +0 +0 +0 +1 ")
file(READ ${WORK}/of_zero/command.csv imported LIMIT 20)
expect_match("command.csv" "${imported}" "t_s,u\n0,9.1\n")
# such a sample in a flight log itself
file(READ ${WORK}/of_zero/command.csv imported)
string(REPLACE "t_s,u\n" "t_s,u\n-1700000000,9\n" imported "${imported}")
file(WRITE ${WORK}/of_zero/command.csv "${imported}")
expect_refused("${WORK}/of_zero/command.csv:3: t_s: 0 comes 1.7e+09 s after that of the line before; accepted: gaps of at most 600 s within a flight"
  check ${WORK}/of_zero)

# ---- a log of ArduPilot as text

file(READ ${WORK}/zero/mapping.toml mapping_of_log)
string(REPLACE "channel = \"*\"\ntime = \"field\"\ntime_field = \"t\"" "channel = \"POSE\"" mapping_of_log "${mapping_of_log}")
file(WRITE ${WORK}/ardupilot/mapping.toml "${mapping_of_log}")
set(rows "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\nFMT, 129, 43, POSE, Qffffffff, TimeUS,u,x,y,z,qw,qx,qy,qz\n")
foreach(i RANGE 9)
  string(APPEND rows "POSE, ${i}0000, 0.${i}, 1.${i}, 2, 3, 1, 0, 0, 0\n")
endforeach()
file(WRITE ${WORK}/ardupilot/flight.log "${rows}")
run(import ${WORK}/ardupilot/flight.log --mapping ${WORK}/ardupilot/mapping.toml --out ${WORK}/of_ardupilot)
expect_equal("stderr" "${err}" "")
file(READ ${WORK}/of_ardupilot/mocap.csv mocap)
expect_match("mocap.csv" "${mocap}" "^t_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n0.01,1.1,2,3,1,0,0,0\n")

# ---- no output replaces what is read

file(COPY ${mapping} DESTINATION ${WORK})
foreach(file IN ITEMS f.mcap ros2.toml)
  expect_kept(${WORK}/${file} --json import ${WORK}/f.mcap --mapping ${WORK}/ros2.toml --out ${WORK}/kept)
endforeach()

# ---- what is refused

set(import import ${WORK}/f.mcap --mapping ${mapping} --out ${WORK}/refused)
expect_refused("${WORK}/none.mcap: cannot be read: No such file or directory" import ${WORK}/none.mcap --mapping ${mapping} --out ${WORK}/refused)
expect_refused("${WORK}/log: holds no bag; accepted: rosbag2's .mcap or .db3 files, or a folder of them"
  import ${WORK}/log --mapping ${mapping} --out ${WORK}/refused)
expect_refused("--set imu.channel=/imuu: imu.channel: \"/imuu\" is not recorded; accepted: /battery, /clock, /imu, /joint_states, /motors, /pose, /tf, /wing_input; did you mean \"/imu\"?"
  ${import} --set imu.channel=/imuu)
file(WRITE ${WORK}/notes/notes.txt "")
expect_refused("${WORK}/notes: holds notes.txt, which is no part of a flight log; accepted: a new folder, an empty one, or a flight log to replace"
  import ${WORK}/f.mcap --mapping ${mapping} --out ${WORK}/notes)
expect_refused("flappy-gap: --mapping is required; see flappy-gap --help" import ${WORK}/f.mcap --out ${WORK}/refused)
if(EXISTS ${WORK}/refused)
  message(SEND_ERROR "something is left of what was refused")
endif()
set(PROGRAM ${FLY})
expect_refused("--mcap: is of one flight, not of 2; accepted: --count 1"
  ${SOURCE}/configs/fly/hover.toml --count 2 --mcap ${WORK}/two.mcap)
expect_refused("${WORK}/none/f.mcap: cannot be written: No such file or directory" ${SOURCE}/configs/fly/hover.toml --mcap ${WORK}/none/f.mcap)
