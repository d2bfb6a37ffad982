# What the program's commands share with the Python package, which has some of them: replay, describe and solve.
add_library(steadyhand_command_line STATIC src/steadyhand/apps/commands/command_line.cpp)
steadyhand_cold(steadyhand_command_line)
target_link_libraries(steadyhand_command_line PUBLIC steadyhand_core PRIVATE CLI11::CLI11)

set(common_commands run progress_bar robot_choice describe_command replay_command solve_command)
list(TRANSFORM common_commands REPLACE "(.+)" "src/steadyhand/apps/commands/\\1.cpp")
add_library(steadyhand_commands STATIC ${common_commands})
steadyhand_cold(steadyhand_commands)
target_link_libraries(steadyhand_commands PUBLIC steadyhand_command_line steadyhand_replay steadyhand_figures)
if(TARGET steadyhand_fitted)
  target_link_libraries(steadyhand_commands PUBLIC steadyhand_fitted)
endif()
