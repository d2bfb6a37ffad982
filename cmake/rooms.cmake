# What nearly every test includes, compiled once.
file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/test_headers.cpp" CONTENT "")
add_library(test_headers OBJECT EXCLUDE_FROM_ALL "${CMAKE_BINARY_DIR}/test_headers.cpp")
target_link_libraries(test_headers PRIVATE Eigen3::Eigen fmt::fmt GTest::gtest nlohmann_json::nlohmann_json)
target_compile_options(test_headers PRIVATE -O1)
target_precompile_headers(test_headers PRIVATE <gtest/gtest.h> <Eigen/Dense> <fmt/format.h> <nlohmann/json.hpp>
                          <filesystem> <fstream> <random>)

# steadyhand_room(NAME USES rooms... LINK libraries... TEST_LINK libraries...): src/NAME/*.cpp becomes the library steadyhand_NAME, tests/NAME/*.cpp
# the executable test_NAME. A room without sources is header-only.
function(steadyhand_room name)
  cmake_parse_arguments(room "" "" "USES;LINK;TEST_LINK" ${ARGN})
  list(TRANSFORM room_USES PREPEND steadyhand_)
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/src/${name}/*.cpp" "${CMAKE_SOURCE_DIR}/src/${name}/*/*.cpp")
  if(sources)
    add_library(steadyhand_${name} STATIC ${sources})
    target_include_directories(steadyhand_${name} PUBLIC "${CMAKE_SOURCE_DIR}/src")
    target_link_libraries(steadyhand_${name} PUBLIC ${room_USES} ${room_LINK})
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
    # Tests are compiled more often than they run.
    target_compile_options(test_${name} PRIVATE -O1)
    target_precompile_headers(test_${name} REUSE_FROM test_headers)
    target_compile_definitions(test_${name} PRIVATE STEADYHAND_ROOT="${CMAKE_SOURCE_DIR}"
                                                    STEADYHAND_DEPS="${STEADYHAND_DEPS}")
    add_test(NAME ${name} COMMAND test_${name} WORKING_DIRECTORY "${CMAKE_SOURCE_DIR}")
    set_property(GLOBAL APPEND PROPERTY steadyhand_tests test_${name})
  endif()
endfunction()
