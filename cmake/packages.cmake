# Third-party packages: Debian's development packages, and what the PyPI wheel `casadi` carries (FATROP, IPOPT, BLASFEO).
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(GTest REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(URDFDOM REQUIRED IMPORTED_TARGET urdfdom)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
add_library(urdf ALIAS PkgConfig::URDFDOM)
add_library(zstd ALIAS PkgConfig::ZSTD)

file(GLOB site_packages "${STEADYHAND_DEPS}/venv/lib/python3*/site-packages")
if(NOT EXISTS "${site_packages}/casadi/include/fatrop/fatrop.hpp")
  message(FATAL_ERROR "FATROP not found under ${STEADYHAND_DEPS}: run ./steadyhand once, it installs the pinned packages")
endif()

# The wheel's own CMake config points where nothing is, so the target is defined here. FATROP's headers need -w.
add_library(fatrop SHARED IMPORTED)
set_target_properties(fatrop PROPERTIES IMPORTED_LOCATION "${site_packages}/casadi/libfatrop.so")
add_library(blasfeo SHARED IMPORTED)
set_target_properties(blasfeo PROPERTIES IMPORTED_LOCATION "${site_packages}/casadi/libblasfeo.so")
# Only FATROP's and BLASFEO's headers: the wheel also carries an Eigen that must not shadow the system's.
set(casadi_headers "${CMAKE_BINARY_DIR}/casadi_headers")
file(MAKE_DIRECTORY "${casadi_headers}")
file(GLOB wheel_headers "${site_packages}/casadi/include/blasfeo*.h" "${site_packages}/casadi/include/fatrop"
     "${site_packages}/casadi/include/coin-or")
foreach(header ${wheel_headers})
  get_filename_component(name "${header}" NAME)
  file(CREATE_LINK "${header}" "${casadi_headers}/${name}" SYMBOLIC)
endforeach()
target_include_directories(fatrop SYSTEM INTERFACE "${casadi_headers}")
target_link_libraries(fatrop INTERFACE blasfeo)
