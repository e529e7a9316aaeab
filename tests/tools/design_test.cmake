# flappy-design as a person meets it: what it prints, writes and refuses, and its exit codes.
#   cmake -DPROGRAM=flappy-design -DFLY=flappy-fly -DSOURCE=the project -DWORK=a folder to use -P design_test.cmake
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/program.cmake)

set(tuning 0)
set(cost NULL)
if(DEFINED ENV{FLAPPY_FULL_TESTS})
  set(tuning 1)
  set(cost NUMBER)
endif()
set(config configs/design/hummingbird.toml)
set(small --set flights.hover=8 --set flights.escape=4 --set flights.effects=1 --set search.population=8 --set search.generations=2 --set verify.designs=1
  --set verify.vehicles=8 --set verify.generations=${tuning} --set verify.step_s=125e-6)

# ---- a small search, and the same command again

run(${config} --out ${WORK}/out ${small} --json ${WORK}/out.json)
expect_equal("exit code (${err})" "${code}" 0)
expect_match("stdout" "${out}" "^generation 1 of 2: [0-9]+ designs, [0-9]+ on the front, hypervolume [0-9.]+, ")
expect_match("stdout" "${out}" "shown by: flappy-report ${WORK}/out")
expect_keys(${WORK}/out.json designs=NUMBER front=NUMBER hypervolume=NUMBER given_away=ARRAY)
foreach(name IN ITEMS config.toml designs.csv front.csv search.csv design.json)
  file(READ ${WORK}/out/${name} ${name})
endforeach()
expect_keys(${WORK}/out/design.json designs.0.tuned_cost=${cost} designs.0.fine.hover_power_W=NUMBER designs.0.sensitivity=ARRAY)
if(DEFINED ENV{FLAPPY_FULL_TESTS})  # half a minute
  run(${config} --out ${WORK}/out ${small})
  foreach(name IN ITEMS config.toml designs.csv front.csv search.csv design.json)
    file(READ ${WORK}/out/${name} again)
    expect_equal("${name} of a second run" "${again}" "${${name}}")
  endforeach()
endif()
foreach(name IN ITEMS hover escape)
  execute_process(COMMAND ${FLY} ${WORK}/out/designs/00/${name}.toml --count 4 RESULT_VARIABLE code ERROR_VARIABLE err)
  expect_equal("flappy-fly of the published robot's ${name}.toml (${err})" "${code}" 0)
endforeach()

# ---- limits that nothing meets; the published robot misses them, too

set(none ${config} --out ${WORK}/none ${small} --set "limit=[{figure=\"mass_kg\",at_most=0.001}]")
run(${none} --json ${WORK}/none.json)
expect_equal("exit code of limits that nothing meets (${err})" "${code}" 1)
expect_match("stdout" "${out}" "\nno design met the limits; of ([0-9]+) designs were refused:\n  [0-9]+: mass_kg above 0.001\n")
expect_match("stdout" "${out}" "\n${WORK}/none/designs.csv has the figures of each\nthe published robot misses limits: mass_kg is 0.01[0-9]+, above 0.001\n$")
foreach(text IN ITEMS "${out}" "${err}")
  if("${text}" MATCHES "nan")
    message(SEND_ERROR "a figure that is no number:\n${text}")
  endif()
endforeach()
expect_keys(${WORK}/none.json front=NUMBER given_away.0=NULL refused.0.why=STRING refused.0.designs=NUMBER published_misses=STRING)
foreach(name IN ITEMS config.toml designs.csv search.csv)
  file(READ ${WORK}/none/${name} ${name})
endforeach()
run(${none})
expect_equal("exit code of the same command again (${err})" "${code}" 1)
foreach(name IN ITEMS config.toml designs.csv search.csv)
  file(READ ${WORK}/none/${name} again)
  expect_equal("${name} of a second run that nothing meets" "${again}" "${${name}}")
endforeach()

# ---- what another version judged is not mixed in

file(READ ${WORK}/none/config.toml kept)
string(REGEX REPLACE "(# judged by flappy at commit )[^\n]+\n$" "\\1abcdef012345\n" kept "${kept}")
file(WRITE ${WORK}/none/config.toml "${kept}")
expect_refused("${WORK}/none/config.toml: its designs were judged by flappy at commit abcdef012345; accepted: a new folder, or that version" ${none})

# ---- refusals

expect_refused("${WORK}/out/config.toml: is another configuration; accepted: a new folder, or the same configuration" ${config} --out ${WORK}/out)
file(MAKE_DIRECTORY ${WORK}/other)
file(WRITE ${WORK}/other/notes.txt "mine")
expect_refused("${WORK}/other: is no folder of flappy-design; accepted: a new folder, or one to go on in" ${config} --out ${WORK}/other ${small})
expect_refused("${WORK}/gone.toml: cannot be read: No such file or directory" ${WORK}/gone.toml --out ${WORK}/new)
expect_refused("${WORK}/gone.toml: cannot be read: No such file or directory" ${config} --out ${WORK}/new --train ${WORK}/gone.toml)
expect_refused("${WORK}/other/notes.txt: is no folder; accepted: a new folder, or one to go on in" ${config} --out ${WORK}/other/notes.txt ${small})
file(READ ${SOURCE}/${config} text)
string(REPLACE "../" "${SOURCE}/configs/" text "${text}")
string(REPLACE "motors.toml" "${SOURCE}/configs/design/motors.toml" text "${text}")
function(refuse_edited from to line)
  string(REPLACE "${from}" "${to}" edited "${text}")
  file(WRITE ${WORK}/edited.toml "${edited}")
  run(${WORK}/edited.toml --out ${WORK}/new)
  expect_match("the refusal" "${err}" "^${WORK}/edited.toml:[0-9]+:[0-9]+: ${line}\n$")
  expect_equal("exit code" "${code}" 2)
endfunction()
refuse_edited("figure = \"hover_power_W\"" "figure = \"hover_power\""
  "objective.0..figure: no figure has this name; accepted: mass_kg, .*; did you mean \"hover_power_W\".")
refuse_edited("[vary]" "[varies]" "varies: unknown key; accepted: .*")
refuse_edited("figure = \"stroke_rad\"" "figure = \"stroke_rad\"\nat_last = 1" "limit.0..at_last: unknown key; accepted: .*")
if(EXISTS ${WORK}/new)
  message(SEND_ERROR "a refused run left a folder")
endif()

# ---- no output replaces what is read

expect_kept(${WORK}/out/config.toml --json ${config} --out ${WORK}/out ${small})
