# The same bits from every compiler and optimisation level: nothing is contracted or reordered behind our back.
add_library(flappy_options INTERFACE)
target_compile_options(flappy_options INTERFACE
  -ffp-contract=off -fno-math-errno -fno-trapping-math
  -Wall -Wextra -Wpedantic -Wconversion -Wno-sign-conversion -Wshadow -Wno-missing-field-initializers -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # false alarms of gcc 12 on string concatenation (gcc bug 105651), and of types in one of the sources that a unity build joins
  target_compile_options(flappy_options INTERFACE -Wno-restrict -Wno-subobject-linkage)
  # it collects its garbage from a gigabyte on, which takes less time for more memory
  target_compile_options(flappy_options INTERFACE --param=ggc-min-heapsize=1000000)
endif()

# What guards a program that reads what others wrote. Kernels read nothing, and go without, as their speed is all they have.
add_library(flappy_hardening INTERFACE)
target_compile_options(flappy_hardening INTERFACE $<$<CONFIG:Release>:-U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2 -fstack-protector-strong>)
target_link_options(flappy_hardening INTERFACE -Wl,-z,relro -Wl,-z,now $<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:-pie>)

# A folder is a room, and a room is a static library; headers are included from src/ and include/. Its sources are all of the
# folders given, but for those of kernels, which are compiled once for each instruction set.
function(flappy_room name)
  cmake_parse_arguments(ARG "" "SUFFIX" "FOLDERS;WITHOUT;SOURCES" ${ARGN})
  foreach(folder IN LISTS ARG_FOLDERS)
    file(GLOB found CONFIGURE_DEPENDS ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/${folder}/*.cpp)
    list(APPEND ARG_SOURCES ${found})
  endforeach()
  foreach(file IN LISTS ARG_WITHOUT)
    list(REMOVE_ITEM ARG_SOURCES ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/${file})
  endforeach()
  add_library(${name} STATIC ${ARG_SOURCES})
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_FUNCTION_LIST_DIR}> $<BUILD_INTERFACE:${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../include>
    $<INSTALL_INTERFACE:include>)
  target_include_directories(${name} SYSTEM PUBLIC $<BUILD_INTERFACE:${RANDOM123_INCLUDE}>)
  target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:flappy_options> $<BUILD_INTERFACE:flappy_hardening>)
endfunction()

# One C++ source that holds text files, of this folder or by their full paths, by their names, in the map that a header declares.
function(flappy_embed output header namespace variable)
  list(TRANSFORM ARGN PREPEND ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/ REGEX "^[^/]")
  file(GLOB files CONFIGURE_DEPENDS ${ARGN})
  set(script ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/deploy/embed.cmake)
  add_custom_command(OUTPUT ${output} COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DHEADER=${header} -DNAMESPACE=${namespace}
    -DVARIABLE=${variable} "-DFILES=${files}" -P ${script} DEPENDS ${files} ${script} VERBATIM)
  set_source_files_properties(${output} PROPERTIES COMPILE_OPTIONS -Wno-overlength-strings)  # which clang tells of in C++
endfunction()

# A part that is opened on demand, from one source: lib/flappy/NAME.so.
function(flappy_plugin name source)
  add_library(flappy_${name} MODULE ${source})
  set_target_properties(flappy_${name} PROPERTIES PREFIX "" OUTPUT_NAME ${name} LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib/flappy)
  target_link_libraries(flappy_${name} PRIVATE flappy_io ${ARGN} flappy_options flappy_hardening)
  target_compile_options(flappy_${name} PRIVATE $<$<CONFIG:Release>:-O1>)  # their work is done in the libraries that they open
  set_property(GLOBAL APPEND PROPERTY flappy_installed flappy_${name})
  set(component torch)
  if(name MATCHES "^(onnx|matlab)$")
    set(component programs)
  endif()
  install(TARGETS flappy_${name} LIBRARY DESTINATION lib/flappy COMPONENT ${component})
endfunction()

# Objects of one source compiled once for each instruction set, with further options. The second time round, with a suffix, only v3
# is compiled anew. Few processors run scalar code or v2, which need their bits, not their speed.
function(flappy_kernels objects name suffix source)
  if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
    set(sets scalar neon)
  else()
    set(sets scalar v2 v3 v4)
  endif()
  foreach(set IN LISTS sets)
    set(kernel ${name}_${set}${suffix})
    if(suffix AND NOT set STREQUAL "v3")
      list(APPEND all $<TARGET_OBJECTS:${name}_${set}>)
      continue()
    endif()
    add_library(${kernel} OBJECT ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/${source})
    target_include_directories(${kernel} PRIVATE ${CMAKE_CURRENT_FUNCTION_LIST_DIR} ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../include)
    target_link_libraries(${kernel} PRIVATE flappy_options)
    # unaligned, the same code was once seen at half its speed; a copy of a few rows is slower as a call of memcpy
    target_compile_options(${kernel} PRIVATE ${ARGN} -falign-functions=64
      $<$<CXX_COMPILER_ID:GNU>:-fno-tree-loop-distribute-patterns -frename-registers>)
    target_compile_definitions(${kernel} PRIVATE FLAPPY_ISA=${set})
    if(set MATCHES "^(scalar|v2)$")
      target_compile_options(${kernel} PRIVATE $<$<CONFIG:Release>:-O1>)
    endif()
    if(set STREQUAL "scalar")
      target_compile_definitions(${kernel} PRIVATE FLAPPY_SCALAR FLAPPY_ISA_NAME="scalar")
    elseif(set STREQUAL "neon")
      target_compile_definitions(${kernel} PRIVATE FLAPPY_ISA_NAME="neon")
    else()
      target_compile_options(${kernel} PRIVATE -march=x86-64-${set})
      target_compile_definitions(${kernel} PRIVATE FLAPPY_ISA_NAME="x86-64-${set}")
    endif()
    list(APPEND all $<TARGET_OBJECTS:${kernel}>)
  endforeach()
  set(${objects} ${all} PARENT_SCOPE)
endfunction()

# The rooms that compute what the determinism contract holds: model, simulator, closed loop, learner in lanes. `suffix` and
# further options let the tests build them a second time.
function(flappy_simulator suffix)
  flappy_room(flappy_model${suffix} FOLDERS model model/effects)
  target_link_libraries(flappy_model${suffix} PUBLIC flappy_io PRIVATE $<BUILD_INTERFACE:Eigen3::Eigen>)

  flappy_kernels(step_objects flappy_step "${suffix}" sim/step.cpp ${ARGN})
  flappy_kernels(beat_averaged_objects flappy_beat_averaged_step "${suffix}" sim/beat_averaged_step.cpp ${ARGN})
  flappy_kernels(jointed_objects flappy_jointed_step "${suffix}" sim/jointed_step.cpp ${ARGN})
  flappy_room(flappy_sim${suffix} FOLDERS sim WITHOUT sim/step.cpp sim/beat_averaged_step.cpp sim/jointed_step.cpp
    SOURCES ${step_objects} ${beat_averaged_objects} ${jointed_objects})
  target_link_libraries(flappy_sim${suffix} PUBLIC flappy_model${suffix})

  flappy_kernels(loop_objects flappy_loop "${suffix}" flight/closed_loop.cpp ${ARGN})
  flappy_room(flappy_flight${suffix} FOLDERS flight WITHOUT flight/closed_loop.cpp SOURCES ${loop_objects})
  target_link_libraries(flappy_flight${suffix} PUBLIC flappy_sim${suffix} flappy_policy)

  flappy_kernels(update_objects flappy_update "${suffix}" learn/lanes/update.cpp ${ARGN})
  flappy_room(flappy_lanes${suffix} FOLDERS learn/lanes WITHOUT learn/lanes/update.cpp
    SOURCES ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/learn/replay_buffer.cpp ${update_objects})
  target_link_libraries(flappy_lanes${suffix} PUBLIC flappy_flight${suffix})

  foreach(room IN ITEMS model sim flight lanes)
    target_compile_options(flappy_${room}${suffix} PRIVATE ${ARGN})
    set_target_properties(flappy_${room}${suffix} PROPERTIES UNITY_BUILD OFF)  # their bits are those of each source for itself
  endforeach()
endfunction()
