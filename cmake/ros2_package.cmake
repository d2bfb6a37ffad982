# What makes the installed folder a package of ROS 2: `ros2 launch steadyhand steadyhand.launch.py` finds it.
install(FILES package.xml DESTINATION "${data_destination}")
install(DIRECTORY ros2/ DESTINATION "${data_destination}")
file(WRITE "${PROJECT_BINARY_DIR}/ament_index/steadyhand" "")
install(FILES "${PROJECT_BINARY_DIR}/ament_index/steadyhand" DESTINATION "${CMAKE_INSTALL_DATADIR}/ament_index/resource_index/packages")
