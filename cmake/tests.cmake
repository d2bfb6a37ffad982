# Tests, examples, benchmarks and their tools. Everything that `ctest` runs is built by the target `tests`.
if(NOT STEADYHAND_SANITIZE)
  add_subdirectory(examples EXCLUDE_FROM_ALL)
endif()

# Closed loops of the solvers, for bench/.
add_executable(bench_solvers EXCLUDE_FROM_ALL bench/solvers.cpp bench/closed_loop.cpp bench/sequences.cpp)
steadyhand_cold(bench_solvers)
target_link_libraries(bench_solvers PRIVATE steadyhand_config steadyhand_input steadyhand_record steadyhand_command_line)
target_include_directories(bench_solvers PRIVATE tests)
add_executable(bench_problems EXCLUDE_FROM_ALL bench/problems.cpp)
steadyhand_cold(bench_problems)
target_link_libraries(bench_problems PRIVATE steadyhand_config steadyhand_command_line nlohmann_json::nlohmann_json)
target_include_directories(bench_problems PRIVATE tests)
add_executable(bench_two_arms EXCLUDE_FROM_ALL bench/two_arms.cpp)
steadyhand_cold(bench_two_arms)
target_link_libraries(bench_two_arms PRIVATE steadyhand_config steadyhand_input steadyhand_pipeline steadyhand_command_line)
add_executable(bench_stalls EXCLUDE_FROM_ALL bench/stalls.cpp)
steadyhand_cold(bench_stalls)
target_link_libraries(bench_stalls PRIVATE steadyhand_config steadyhand_driver steadyhand_input steadyhand_live GTest::gtest)
target_include_directories(bench_stalls PRIVATE tests)

# A Universal Robots controller for tests, and as a program to try `--arm ur` with.
file(GLOB fake_ur_sources CONFIGURE_DEPENDS tests/support/ur/*.cpp)
add_library(steadyhand_fake_ur STATIC EXCLUDE_FROM_ALL ${fake_ur_sources})
steadyhand_cold(steadyhand_fake_ur)
target_include_directories(steadyhand_fake_ur PUBLIC tests)
target_link_libraries(steadyhand_fake_ur PUBLIC steadyhand_ur)
add_executable(fake_ur_controller EXCLUDE_FROM_ALL tests/tools/fake_ur_controller.cpp)
steadyhand_cold(fake_ur_controller)
target_link_libraries(fake_ur_controller PRIVATE steadyhand_fake_ur steadyhand_config steadyhand_command_line)

if(STEADYHAND_MUJOCO)
  target_link_libraries(test_driver PRIVATE steadyhand_mujoco)
else()
  steadyhand_untested(mujoco "built without MuJoCo: mujoco-core is not installed")
endif()

# A ROS 2 joint trajectory controller for tests, and as a program to try `--arm ros2` with.
if(STEADYHAND_ROS2)
  add_library(steadyhand_reference_controller STATIC EXCLUDE_FROM_ALL tests/support/ros2/reference_controller.cpp
              tests/support/ros2/joint_trajectory_controller.cpp)
  steadyhand_cold(steadyhand_reference_controller)
  target_include_directories(steadyhand_reference_controller PUBLIC tests)
  target_link_libraries(steadyhand_reference_controller PUBLIC steadyhand_ros2)
  target_link_libraries(test_driver PRIVATE steadyhand_reference_controller)
  target_link_libraries(test_live PRIVATE steadyhand_reference_controller)
  add_executable(reference_controller EXCLUDE_FROM_ALL tests/tools/reference_controller.cpp)
  steadyhand_cold(reference_controller)
  target_link_libraries(reference_controller PRIVATE steadyhand_reference_controller steadyhand_config steadyhand_command_line)
  add_executable(ros2_echo EXCLUDE_FROM_ALL tests/tools/ros2_echo.cpp)
  steadyhand_cold(ros2_echo)
  target_link_libraries(ros2_echo PRIVATE steadyhand_ros2)
endif()

# Before Fast DDS, where that is installed: for tests only, and not under sanitizers, which stop at its own new and delete.
find_package(fastrtps QUIET)
if(STEADYHAND_ROS2 AND TARGET fastrtps AND NOT STEADYHAND_SANITIZE)
  add_executable(test_ros2_fast_dds EXCLUDE_FROM_ALL tests/arms/ros2/fast_dds/fast_dds_test.cpp)
  steadyhand_cold(test_ros2_fast_dds)
  target_include_directories(test_ros2_fast_dds PRIVATE tests)
  target_link_libraries(test_ros2_fast_dds PRIVATE steadyhand_reference_controller fastrtps fastcdr GTest::gtest_main)
  add_test(NAME ros2_fast_dds COMMAND test_ros2_fast_dds)
  set_property(GLOBAL APPEND PROPERTY steadyhand_tests test_ros2_fast_dds)
elseif(NOT STEADYHAND_SANITIZE)
  steadyhand_untested(ros2_fast_dds "Fast DDS (libfastrtps-dev) or Cyclone DDS is not installed")
endif()
if(NOT STEADYHAND_ROS2)
  steadyhand_untested(ros2 "built without ROS 2: cyclonedds-dev and cyclonedds-tools are not installed")
endif()

# Writes a recording and a report made by formulas, for the tests in Python that read them.
add_executable(write_sample EXCLUDE_FROM_ALL tests/tools/write_sample.cpp)
steadyhand_cold(write_sample)
target_include_directories(write_sample PRIVATE tests)
target_link_libraries(write_sample PRIVATE steadyhand_figures)

# What this build plans, for comparison with WebAssembly's.
add_executable(closed_loop EXCLUDE_FROM_ALL tests/tools/closed_loop.cpp)
steadyhand_cold(closed_loop)
target_link_libraries(closed_loop PRIVATE steadyhand_browser)

include(cmake/fuzz.cmake)

# The vector type at every width, whatever the host has; one of them in the short tier.
foreach(lanes 1 2 4 8)
  add_executable(test_lanes_${lanes} EXCLUDE_FROM_ALL tests/core/lanes_test.cpp)
  target_compile_definitions(test_lanes_${lanes} PRIVATE STEADYHAND_LANES=${lanes})
  target_compile_options(test_lanes_${lanes} PRIVATE ${STEADYHAND_COLD_OPTIONS} -Wno-psabi)  # vectors wider than the host's are passed in memory
  target_link_libraries(test_lanes_${lanes} PRIVATE steadyhand_core GTest::gtest_main)
  add_test(NAME lanes_${lanes} COMMAND test_lanes_${lanes})
  if(lanes EQUAL 4)
    steadyhand_tier(lanes_${lanes} ON)
  else()
    steadyhand_long(lanes_${lanes})
  endif()
endforeach()

# The lock-free structures under a weak memory model, where Relacy is installed; it has its own stacks and memory.
find_path(RELACY_FOLDER relacy/relacy.hpp)
if(RELACY_FOLDER AND NOT STEADYHAND_SANITIZE)
  add_executable(test_weak_memory EXCLUDE_FROM_ALL tests/core/weak_memory/weak_memory_test.cpp)
  target_include_directories(test_weak_memory PRIVATE src)
  target_compile_options(test_weak_memory PRIVATE -O1 -fno-sized-deallocation)
  target_link_libraries(test_weak_memory PRIVATE GTest::gtest_main)
  add_test(NAME weak_memory COMMAND test_weak_memory)
  set_property(GLOBAL APPEND PROPERTY steadyhand_tests test_weak_memory)
elseif(NOT STEADYHAND_SANITIZE)
  steadyhand_untested(weak_memory "Relacy (relacy-dev) is not installed")
endif()

include(cmake/processors.cmake)

# What is run under ThreadSanitizer: tests of parts with threads that ask for no speed, and the program, which the adversary
# attacks (tests/python/test_adversary.py). Cyclone DDS is not compiled for that.
set(threaded core supervise driver server console)
set_property(TEST ${threaded} APPEND PROPERTY LABELS threads)
if(STEADYHAND_SANITIZE MATCHES thread)
  set_tests_properties(driver PROPERTIES ENVIRONMENT "GTEST_FILTER=TwoArms.RunOnTwoThreads")
  set_tests_properties(server PROPERTIES ENVIRONMENT "GTEST_FILTER=-ServerTest.StatesReach64*")  # within 250 ms
endif()
list(TRANSFORM threaded PREPEND test_)
add_custom_target(threaded DEPENDS steadyhand ${threaded})

if(TEST live)
  set_tests_properties(live PROPERTIES COST 100)  # begins first
endif()

# Everything that `ctest` runs, but for what only `./steadyhand test --long` builds.
get_property(long_test_targets GLOBAL PROPERTY steadyhand_long_tests)
add_custom_target(long_tests DEPENDS ${long_test_targets} closed_loop)
get_property(test_targets GLOBAL PROPERTY steadyhand_tests)
add_custom_target(tests DEPENDS ${test_targets})
if(STEADYHAND_SANITIZE)
  return()
endif()
# What tests/python runs, and installs.
get_property(libraries GLOBAL PROPERTY steadyhand_libraries)
add_dependencies(tests examples write_sample fake_ur_controller ${libraries})
if(STEADYHAND_WITH_PYTHON)
  add_dependencies(tests steadyhand_module steadyhand_stub)
endif()
if(STEADYHAND_ROS2)
  add_dependencies(tests reference_controller ros2_echo)
endif()
