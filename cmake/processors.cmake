# The hot parts and their tests for other processors than the preset's, each level with a vector width of its own (core/lanes.hpp).
# Whatever the host has, the parts are compiled, but for the level that the preset is for; their tests are compiled and run where it can, and elsewhere ctest says that
# they were skipped. They are among the long tests.
# A level cannot share libraries with another: inline functions and the layout of Eigen's members depend on it.
file(GLOB hot_sources CONFIGURE_DEPENDS src/steadyhand/core/*.cpp src/steadyhand/geometry/collision/*.cpp src/steadyhand/geometry/robot/*.cpp src/steadyhand/planning/liquid/*.cpp src/steadyhand/planning/ocp/*.cpp)
file(GLOB hot_solvers CONFIGURE_DEPENDS src/steadyhand/planning/solve/*.cpp src/steadyhand/planning/solve/*/*.cpp src/steadyhand/planning/plan/*.cpp)
set(hot_tests tests/core/lanes_test.cpp tests/geometry/collision/proximity_test.cpp tests/geometry/robot/kinematics_test.cpp tests/planning/ocp/terms_test.cpp)
set(hot_solver_tests tests/planning/solve/batch_evaluation_test.cpp tests/planning/solve/realtime_test.cpp tests/planning/plan/planner_test.cpp)
# Compiled as a file for each group, in a third of the time; so what they keep in unnamed namespaces needs names of its own.
set_source_files_properties(${hot_sources} PROPERTIES UNITY_GROUP sources)
set_source_files_properties(${hot_solvers} PROPERTIES UNITY_GROUP solvers)
set_source_files_properties(${hot_tests} PROPERTIES UNITY_GROUP tests)
set_source_files_properties(${hot_solver_tests} PROPERTIES UNITY_GROUP solver_tests)
set(host_flags "")
if(EXISTS /proc/cpuinfo)
  file(STRINGS /proc/cpuinfo host_flags REGEX "^flags" LIMIT_COUNT 1)
endif()

function(steadyhand_processor level lanes flag)
  if(STEADYHAND_NATIVE AND lanes EQUAL STEADYHAND_LANES)
    return()  # the preset's own tests are of this level
  endif()
  if("${host_flags} " MATCHES " ${flag} ")
    add_executable(test_${level} EXCLUDE_FROM_ALL ${hot_sources} ${hot_solvers} ${hot_tests} ${hot_solver_tests})
    target_link_libraries(test_${level} PRIVATE GTest::gtest_main)
    add_test(NAME ${level} COMMAND test_${level} WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}")
  else()
    add_library(test_${level} OBJECT EXCLUDE_FROM_ALL ${hot_sources} ${hot_solvers})
    steadyhand_untested(${level} "this processor is not of the level ${level}")
  endif()
  set_target_properties(test_${level} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  target_compile_options(test_${level} PRIVATE -march=${level} ${STEADYHAND_WARM_OPTIONS})
  target_compile_definitions(test_${level} PRIVATE STEADYHAND_LANES=${lanes} STEADYHAND_FATROP
                             STEADYHAND_ROOT="${PROJECT_SOURCE_DIR}" STEADYHAND_DEPS="${STEADYHAND_DEPS}")
  steadyhand_public(test_${level})
  target_include_directories(test_${level} PRIVATE tests)
  target_link_libraries(test_${level} PRIVATE Eigen3::Eigen fmt::fmt urdf tinyxml2 fatrop)
  steadyhand_long(${level})
endfunction()

# The sanitizers' presets are for plain x86-64.
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64" AND STEADYHAND_WITH_FATROP AND NOT STEADYHAND_SANITIZE MATCHES thread)
  steadyhand_processor(x86-64-v3 4 avx2)
  steadyhand_processor(x86-64-v4 8 avx512vl)
endif()
