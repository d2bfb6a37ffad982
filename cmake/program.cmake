# The program `steadyhand`.
file(GLOB app_sources CONFIGURE_DEPENDS src/steadyhand/apps/commands/*.cpp)
list(FILTER app_sources EXCLUDE REGEX "/(command_line|run|progress_bar|robot_choice|describe_command|replay_command|solve_command).cpp")
add_executable(steadyhand ${app_sources})
steadyhand_cold(steadyhand)
set_target_properties(steadyhand PROPERTIES UNITY_BUILD OFF)  # each command has Options of its own
target_link_libraries(steadyhand PRIVATE steadyhand_console steadyhand_browser steadyhand_commands)
foreach(part visual mujoco simulate video render ur ros2)
  if(TARGET steadyhand_${part})
    target_link_libraries(steadyhand PRIVATE steadyhand_${part})
  endif()
endforeach()
