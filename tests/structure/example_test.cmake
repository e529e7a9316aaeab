# Installs the build to a prefix of its own, then configures, builds and runs examples/hover against it.
set(prefix ${BUILD_DIR}/example/prefix)
set(build ${BUILD_DIR}/example/build)
file(REMOVE_RECURSE ${BUILD_DIR}/example)

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${code}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})
run(${CMAKE_COMMAND} -S ${SOURCE_DIR}/examples/hover -B ${build} -G Ninja -DCMAKE_PREFIX_PATH=${prefix}
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${build})
run(${build}/hover ${prefix}/share/flappy/configs/vehicles/hummingbird_nominal.toml)
message("${output}")
if(NOT output MATCHES "^hummingbird_nominal lifts off at (8|9|10)\\.[0-9] V\n$")
  message(FATAL_ERROR "not the expected output")
endif()
