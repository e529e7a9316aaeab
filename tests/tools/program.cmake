# What the tests of programs share: PROGRAM is run, WORK is an empty folder to use.
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})

# Runs the program; leaves `out`, `err`, `code`.
macro(run)
  execute_process(COMMAND ${PROGRAM} ${ARGN} OUTPUT_VARIABLE out ERROR_VARIABLE err RESULT_VARIABLE code)
endmacro()

function(expect_equal what actual expected)
  if(NOT "${actual}" STREQUAL "${expected}")
    message(SEND_ERROR "${what}:\n  is       ${actual}\n  expected ${expected}")
  endif()
endfunction()

function(expect_match what actual pattern)
  if(NOT "${actual}" MATCHES "${pattern}")
    message(SEND_ERROR "${what} lacks ${pattern}:\n${actual}")
  endif()
endfunction()

# Exit code 2, `line` alone on stderr, nothing on stdout, no file (not even a temporary one) where --json pointed.
function(expect_refused line)
  run(${ARGN} --json ${WORK}/refused.json)
  expect_equal("stderr" "${err}" "${line}\n")
  expect_equal("stdout of: ${line}" "${out}" "")
  expect_equal("exit code of: ${line}" "${code}" 2)
  file(GLOB left ${WORK}/refused.json*)
  expect_equal("files left by: ${line}" "${left}" "")
endfunction()

# `file` is read by the command, and so refused as the output `option`; it stays as it is.
function(expect_kept file option)
  file(SHA256 ${file} before)
  run(${ARGN} ${option} ${file})
  expect_match("stderr of ${option} ${file}" "${err}" "(^|\n)${file}: is read by the same command; accepted: another file\n$")
  expect_equal("exit code of ${option} ${file}" "${code}" 2)
  file(SHA256 ${file} after)
  expect_equal("${file}, which ${option} would replace" "${after}" "${before}")
endfunction()

# These keys (dotted) are there, and are what they say; others may join them.
function(expect_keys file)
  file(READ ${file} json)
  foreach(pair IN LISTS ARGN)
    string(REPLACE "=" ";" pair "${pair}")
    list(GET pair 0 key)
    list(GET pair 1 type)
    string(REPLACE "." ";" path "${key}")
    string(JSON actual ERROR_VARIABLE missing TYPE "${json}" ${path})
    expect_equal("${key} in ${file}" "${actual}" "${type}")
  endforeach()
endfunction()
