# share/steadyhand beside what is built, as `cmake --install` lays it out (config/places.hpp): robots, profiles, recordings of
# hands, and `packages`, where the URDFs of Python packages are.
set(data_folder "${PROJECT_BINARY_DIR}/share/steadyhand")
file(MAKE_DIRECTORY "${data_folder}")
function(steadyhand_data name from)
  if(EXISTS "${from}")
    file(CREATE_LINK "${from}" "${data_folder}/${name}" SYMBOLIC)
  endif()
endfunction()
steadyhand_data(robots "${PROJECT_SOURCE_DIR}/robots")
steadyhand_data(cells "${PROJECT_SOURCE_DIR}/cells")
steadyhand_data(profiles "${PROJECT_SOURCE_DIR}/profiles")
steadyhand_data(packages "${site_packages}")
steadyhand_data(recordings "${STEADYHAND_DEPS}/node_modules/super-hands/examples")
