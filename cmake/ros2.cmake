# The messages of ROS 2 as C types, made from IDL by Cyclone DDS's compiler, where that is installed. Without it the rest
# builds all the same, and `--arm ros2` says what to install.
find_package(CycloneDDS QUIET)
find_program(IDLC_PROGRAM idlc)
if(TARGET CycloneDDS::ddsc AND IDLC_PROGRAM)
  set(STEADYHAND_ROS2 ON)
  enable_language(C)
  set(ros2_generated "${PROJECT_BINARY_DIR}/ros2_messages")
  file(MAKE_DIRECTORY "${ros2_generated}")
  # -t: without descriptions of the types, which ROS does not send either and other versions of Cyclone might compare.
  add_custom_command(
    OUTPUT "${ros2_generated}/messages.c" "${ros2_generated}/messages.h"
    COMMAND "${IDLC_PROGRAM}" -t -x final -W no-implicit-extensibility -o "${ros2_generated}"
            "${PROJECT_SOURCE_DIR}/src/steadyhand/arms/ros2/messages.idl"
    DEPENDS "${PROJECT_SOURCE_DIR}/src/steadyhand/arms/ros2/messages.idl"
    COMMENT "Generating the messages of ROS 2" VERBATIM)
  add_library(ros2_messages STATIC "${ros2_generated}/messages.c")
  set_target_properties(ros2_messages PROPERTIES C_STANDARD 99)
  target_compile_options(ros2_messages PRIVATE -w)
  target_include_directories(ros2_messages SYSTEM PUBLIC "${ros2_generated}")
  target_link_libraries(ros2_messages PUBLIC CycloneDDS::ddsc)
else()
  set(STEADYHAND_ROS2 OFF)
  message(STATUS "Without ROS 2: cyclonedds-dev and cyclonedds-tools are not installed")
endif()
