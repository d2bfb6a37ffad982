# For packages that travel: with STEADYHAND_PROCESSORS=x86-64-v2;x86-64-v3;x86-64-v4 the hot rooms become a shared library,
# libsteadyhand_hot.so, compiled once for each level of x86-64, and all else is compiled once, for the least. The dynamic loader
# of glibc takes the library of the highest level that the processor has from the folder glibc-hwcaps/LEVEL beside the
# least's. What the other rooms see of it is laid out the same at every level (core/math.hpp); the width of vectors is not
# among that, so no file outside the hot rooms may compute with Lanes.
set(lanes_of_x86-64-v2 2)
set(lanes_of_x86-64-v3 4)
set(lanes_of_x86-64-v4 8)
foreach(part FATROP UR ROS2 APP PAGE TESTS)
  if(STEADYHAND_WITH_${part})
    message(FATAL_ERROR "STEADYHAND_PROCESSORS is for the Python package alone: it needs STEADYHAND_WITH_${part}=OFF")
  endif()
endforeach()

# Called by steadyhand_room: the room's headers, what it links to, and in place of its own code the library.
function(steadyhand_room_of_levels name sources uses link)
  add_library(steadyhand_${name} INTERFACE)
  target_include_directories(steadyhand_${name} INTERFACE "${PROJECT_SOURCE_DIR}/src" "${PROJECT_BINARY_DIR}/include")
  target_compile_definitions(steadyhand_${name} INTERFACE EIGEN_MAX_ALIGN_BYTES=16)
  list(GET STEADYHAND_PROCESSORS 0 least)
  target_link_libraries(steadyhand_${name} INTERFACE ${uses} ${link} steadyhand_hot_${least})
  set_property(GLOBAL APPEND PROPERTY steadyhand_hot_sources ${sources})
  set_property(GLOBAL APPEND PROPERTY steadyhand_hot_link ${link})
endfunction()

# The library at each level, in python/steadyhand/lib of the build. Compiled as two files, in half the time.
function(steadyhand_levels)
  get_property(sources GLOBAL PROPERTY steadyhand_hot_sources)
  get_property(link GLOBAL PROPERTY steadyhand_hot_link)
  list(REMOVE_DUPLICATES link)
  foreach(source ${sources})
    if(source MATCHES "/(core|robot|ocp)/")
      set_property(SOURCE "${source}" PROPERTY UNITY_GROUP terms)
    else()
      set_property(SOURCE "${source}" PROPERTY UNITY_GROUP solvers)
    endif()
  endforeach()
  set(folder "${PROJECT_BINARY_DIR}/python/steadyhand/lib")
  foreach(level ${STEADYHAND_PROCESSORS})
    set(target steadyhand_hot_${level})
    add_library(${target} SHARED ${sources})
    steadyhand_public(${target})
    set_target_properties(${target} PROPERTIES OUTPUT_NAME steadyhand_hot UNITY_BUILD ON UNITY_BUILD_MODE GROUP
                          LIBRARY_OUTPUT_DIRECTORY "${folder}" LINK_DEPENDS "${PROJECT_SOURCE_DIR}/cmake/exports.map")
    target_compile_options(${target} PRIVATE -march=${level})
    target_compile_definitions(${target} PRIVATE STEADYHAND_LANES=${lanes_of_${level}})
    target_link_libraries(${target} PRIVATE ${link})
    target_link_options(${target} PRIVATE "LINKER:--version-script=${PROJECT_SOURCE_DIR}/cmake/exports.map" LINKER:-Bsymbolic)
    list(GET STEADYHAND_PROCESSORS 0 least)
    if(NOT level STREQUAL least)
      set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY "${folder}/glibc-hwcaps/${level}")
    endif()
  endforeach()
endfunction()
