# Installs the build to a prefix of its own, then configures, builds and runs examples/hover against it. The installed
# programs find the configurations beside them.
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

unset(ENV{FLAPPY_CONFIGS})
foreach(name IN ITEMS bench blind eval export fly gap identify train tune)
  run(${prefix}/bin/flappy-${name} --version)
endforeach()
run(${prefix}/bin/flappy-gap diagnose --help)
if(NOT output MATCHES "${prefix}/share/flappy/configs/gap/priors.toml")
  message(FATAL_ERROR "the installed flappy-gap does not look for its configurations beside itself:\n${output}")
endif()
run(${prefix}/bin/flappy-fly ${prefix}/share/flappy/configs/fly/hover.toml --set flight.duration_s=0.1)
