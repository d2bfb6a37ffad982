# The program `steadyhand`.
add_library(steadyhand_command_line STATIC src/steadyhand/apps/commands/command_line.cpp)
steadyhand_cold(steadyhand_command_line)
target_link_libraries(steadyhand_command_line PUBLIC steadyhand_core PRIVATE CLI11::CLI11)

file(GLOB app_sources CONFIGURE_DEPENDS src/steadyhand/apps/commands/*.cpp)
list(FILTER app_sources EXCLUDE REGEX "/command_line.cpp")
add_executable(steadyhand ${app_sources})
steadyhand_cold(steadyhand)
set_target_properties(steadyhand PROPERTIES UNITY_BUILD OFF)  # each command has Options of its own
target_link_libraries(steadyhand PRIVATE steadyhand_console steadyhand_browser steadyhand_command_line steadyhand_replay steadyhand_figures)
foreach(part visual fitted mujoco simulate video render ur ros2)
  if(TARGET steadyhand_${part})
    target_link_libraries(steadyhand PRIVATE steadyhand_${part})
  endif()
endforeach()

# Its commit, at each build.
set(commit_source "${PROJECT_BINARY_DIR}/commit.cpp")
add_custom_target(steadyhand_commit BYPRODUCTS "${commit_source}"
  COMMAND "${CMAKE_COMMAND}" "-DSOURCE=${PROJECT_SOURCE_DIR}" "-DOUT=${commit_source}" -P "${PROJECT_SOURCE_DIR}/cmake/commit.cmake"
  COMMENT "Re-reading the commit" VERBATIM)  # setup/build.py shows no step that begins so
target_sources(steadyhand PRIVATE "${commit_source}")
add_dependencies(steadyhand steadyhand_commit)
if(STEADYHAND_WITH_PAGE)
  set_property(SOURCE src/steadyhand/apps/commands/version.cpp PROPERTY COMPILE_DEFINITIONS STEADYHAND_PAGE)
endif()
