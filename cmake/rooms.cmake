# Headers that nearly every file includes, compiled once for each way of compiling; -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
# shows whether every file still names what it uses.
file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/empty.cpp" CONTENT "")
function(steadyhand_headers name options libraries)
  add_library(${name} OBJECT EXCLUDE_FROM_ALL "${CMAKE_BINARY_DIR}/empty.cpp")
  target_link_libraries(${name} PRIVATE ${libraries})
  target_compile_options(${name} PRIVATE ${options})
  target_precompile_headers(${name} PRIVATE <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <algorithm> <cmath> <filesystem>
                            <functional> <memory> <optional> <string> <vector> ${ARGN})
endfunction()
set(source_libraries Eigen3::Eigen fmt::fmt)
steadyhand_headers(hot_headers "" "${source_libraries}")
steadyhand_headers(cold_headers "${STEADYHAND_COLD_OPTIONS}" "${source_libraries}")
steadyhand_headers(test_headers "${STEADYHAND_COLD_OPTIONS}" "${source_libraries};GTest::gtest;nlohmann_json::nlohmann_json"
                   <gtest/gtest.h> <Eigen/Dense> <fstream> <nlohmann/json.hpp> <random>)

# Sources that are compiled more often than they run: quickly.
function(steadyhand_cold target)
  target_compile_options(${target} PRIVATE ${STEADYHAND_COLD_OPTIONS})
  target_precompile_headers(${target} REUSE_FROM cold_headers)
endfunction()

# steadyhand_room(NAME HOT USES rooms... LINK libraries... TEST_LINK libraries...): src/steadyhand/NAME/*.cpp becomes the library steadyhand_NAME,
# tests/NAME/*.cpp the executable test_NAME. A room without sources is header-only. HOT: what it does in a planning period or a
# cycle of the arm takes time that counts, so the compiler may take its time, too.
function(steadyhand_room name)
  cmake_parse_arguments(room "HOT" "" "USES;LINK;TEST_LINK" ${ARGN})
  list(TRANSFORM room_USES PREPEND steadyhand_)
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/src/steadyhand/${name}/*.cpp" "${CMAKE_SOURCE_DIR}/src/steadyhand/${name}/*/*.cpp")
  if(sources)
    add_library(steadyhand_${name} STATIC ${sources})
    target_include_directories(steadyhand_${name} PUBLIC "${CMAKE_SOURCE_DIR}/src")
    target_link_libraries(steadyhand_${name} PUBLIC ${room_USES} ${room_LINK})
    if(room_HOT)
      target_precompile_headers(steadyhand_${name} REUSE_FROM hot_headers)
    else()
      steadyhand_cold(steadyhand_${name})
    endif()
  else()
    add_library(steadyhand_${name} INTERFACE)
    target_include_directories(steadyhand_${name} INTERFACE "${CMAKE_SOURCE_DIR}/src")
    target_link_libraries(steadyhand_${name} INTERFACE ${room_USES} ${room_LINK})
  endif()

  file(GLOB tests CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/tests/${name}/*.cpp")
  if(tests)
    add_executable(test_${name} EXCLUDE_FROM_ALL ${tests})
    target_include_directories(test_${name} PRIVATE "${CMAKE_SOURCE_DIR}/tests")
    target_link_libraries(test_${name} PRIVATE steadyhand_${name} ${room_TEST_LINK} GTest::gtest_main)
    target_compile_options(test_${name} PRIVATE ${STEADYHAND_COLD_OPTIONS})
    target_precompile_headers(test_${name} REUSE_FROM test_headers)
    target_compile_definitions(test_${name} PRIVATE STEADYHAND_ROOT="${CMAKE_SOURCE_DIR}"
                                                    STEADYHAND_DEPS="${STEADYHAND_DEPS}")
    add_test(NAME ${name} COMMAND test_${name} WORKING_DIRECTORY "${CMAKE_SOURCE_DIR}")
    set_property(GLOBAL APPEND PROPERTY steadyhand_tests test_${name})
  endif()
endfunction()

# A test that cannot be here: ctest and the summary of ./steadyhand test say why.
function(steadyhand_untested name reason)
  add_test(NAME ${name} COMMAND sh -c "echo '${reason}'; exit 77")
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77)
endfunction()
