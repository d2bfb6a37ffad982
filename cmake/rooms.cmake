# What everybody needs who includes the headers: see core/math.hpp for the alignment.
function(steadyhand_public target)
  target_include_directories(${target} PUBLIC "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>" "$<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>"
                             "$<INSTALL_INTERFACE:include>")
  target_compile_definitions(${target} PUBLIC EIGEN_MAX_ALIGN_BYTES=16)
  target_compile_features(${target} PUBLIC cxx_std_20)
endfunction()

# Headers that nearly every file includes, compiled once for each way of compiling; -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
# shows whether every file still names what it uses.
file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/empty.cpp" CONTENT "")
function(steadyhand_headers name options libraries)
  add_library(${name} OBJECT EXCLUDE_FROM_ALL "${PROJECT_BINARY_DIR}/empty.cpp")
  target_link_libraries(${name} PRIVATE ${libraries})
  target_compile_options(${name} PRIVATE ${options})
  target_compile_definitions(${name} PRIVATE EIGEN_MAX_ALIGN_BYTES=16)
  target_precompile_headers(${name} PRIVATE <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <algorithm> <cmath> <filesystem>
                            <functional> <memory> <optional> <string> <vector> ${ARGN})
endfunction()
set(source_libraries Eigen3::Eigen fmt::fmt)
steadyhand_headers(hot_headers "" "${source_libraries}")
steadyhand_headers(cold_headers "${STEADYHAND_COLD_OPTIONS}" "${source_libraries}")
if(STEADYHAND_WITH_TESTS)
  steadyhand_headers(test_headers "${STEADYHAND_COLD_OPTIONS}" "${source_libraries};GTest::gtest;nlohmann_json::nlohmann_json"
                     <gtest/gtest.h> <Eigen/Dense> <fstream> <nlohmann/json.hpp> <random>)
endif()

# Sources that are compiled more often than they run: quickly.
function(steadyhand_cold target)
  target_compile_options(${target} PRIVATE ${STEADYHAND_COLD_OPTIONS})
  target_precompile_headers(${target} REUSE_FROM cold_headers)
endfunction()

# steadyhand_room(NAME HOT USES rooms... LINK libraries... EXCEPT folders... TEST_LINK libraries... ONCE files...): src/steadyhand/NAME/*.cpp,
# and what its folders hold but those left out, become the library steadyhand_NAME; with tests tests/NAME/*.cpp the executable
# test_NAME. HOT: what it does in a planning period or a cycle of the arm takes time that counts, so the compiler may take
# its time, too; but for its files of ONCE, of which packages for several processors hold one version (cmake/levels.cmake).
function(steadyhand_room name)
  cmake_parse_arguments(room "HOT" "" "USES;LINK;EXCEPT;TEST_LINK;ONCE" ${ARGN})
  list(TRANSFORM room_USES PREPEND steadyhand_)
  set(folder "${PROJECT_SOURCE_DIR}/src/steadyhand/${name}")
  file(GLOB sources CONFIGURE_DEPENDS "${folder}/*.cpp" "${folder}/*/*.cpp")
  foreach(left_out ${room_EXCEPT})
    list(FILTER sources EXCLUDE REGEX "^${folder}/${left_out}/")
  endforeach()
  if(room_HOT AND STEADYHAND_PROCESSORS)
    steadyhand_room_of_levels(${name} "${sources}" "${room_ONCE}" "${room_USES}" "${room_LINK}")
    return()
  endif()
  add_library(steadyhand_${name} STATIC ${sources})
  steadyhand_public(steadyhand_${name})
  target_link_libraries(steadyhand_${name} PUBLIC ${room_USES} ${room_LINK})
  set_property(GLOBAL PROPERTY steadyhand_${name}_link ${room_LINK})
  if(room_HOT)
    target_precompile_headers(steadyhand_${name} REUSE_FROM hot_headers)
  else()
    steadyhand_cold(steadyhand_${name})
  endif()

  file(GLOB tests CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/tests/${name}/*.cpp")
  if(tests AND STEADYHAND_WITH_TESTS)
    add_executable(test_${name} EXCLUDE_FROM_ALL ${tests})
    target_include_directories(test_${name} PRIVATE "${PROJECT_SOURCE_DIR}/tests")
    target_link_libraries(test_${name} PRIVATE steadyhand_${name} ${room_TEST_LINK} GTest::gtest_main)
    target_compile_options(test_${name} PRIVATE ${STEADYHAND_COLD_OPTIONS})
    target_precompile_headers(test_${name} REUSE_FROM test_headers)
    target_compile_definitions(test_${name} PRIVATE STEADYHAND_ROOT="${PROJECT_SOURCE_DIR}"
                                                    STEADYHAND_DEPS="${STEADYHAND_DEPS}")
    add_test(NAME ${name} COMMAND test_${name} WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}")
    set_property(GLOBAL APPEND PROPERTY steadyhand_tests test_${name})
  endif()
endfunction()

# steadyhand_library(NAME USES libraries... ROOMS rooms... OPTIONAL rooms...): the rooms, and those of OPTIONAL that are built,
# as one shared library steadyhand::NAME. It shows what is in namespace steadyhand and keeps the rest to itself, so that what
# was compiled of Eigen for this processor never stands in for what its user compiles.
function(steadyhand_library name)
  cmake_parse_arguments(library "" "" "USES;ROOMS;OPTIONAL" ${ARGN})
  list(TRANSFORM library_USES PREPEND steadyhand::)
  foreach(room ${library_OPTIONAL})
    if(TARGET steadyhand_${room})
      list(APPEND library_ROOMS ${room})
    endif()
  endforeach()
  set(exports "${PROJECT_SOURCE_DIR}/cmake/exports.map")
  add_library(steadyhand_${name}_library SHARED)
  add_library(steadyhand::${name} ALIAS steadyhand_${name}_library)
  set_target_properties(steadyhand_${name}_library PROPERTIES OUTPUT_NAME steadyhand_${name} EXPORT_NAME ${name} LINK_DEPENDS "${exports}"
                        VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  steadyhand_public(steadyhand_${name}_library)
  target_link_libraries(steadyhand_${name}_library PUBLIC ${library_USES} Eigen3::Eigen)
  foreach(room ${library_ROOMS})
    get_property(link GLOBAL PROPERTY steadyhand_${room}_link)
    target_sources(steadyhand_${name}_library PRIVATE "$<TARGET_OBJECTS:steadyhand_${room}>")
    target_link_libraries(steadyhand_${name}_library PRIVATE ${link})
  endforeach()
  target_link_options(steadyhand_${name}_library PRIVATE "LINKER:--version-script=${exports}" LINKER:-Bsymbolic)
  set_property(GLOBAL APPEND PROPERTY steadyhand_libraries steadyhand_${name}_library)
  set_property(GLOBAL APPEND PROPERTY steadyhand_installed_rooms ${library_ROOMS})
endfunction()

# A test that cannot be here: ctest and the summary of ./steadyhand test say why.
function(steadyhand_untested name reason)
  add_test(NAME ${name} COMMAND sh -c "echo '${reason}'; exit 77")
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77)
endfunction()
