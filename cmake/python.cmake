# The Python package: the module steadyhand._native (src/steadyhand/apps/python), and beside it python/steadyhand, so that
# PYTHONPATH=build/PRESET/python imports it.
if(NOT SKBUILD AND NOT Python_EXECUTABLE AND EXISTS "${STEADYHAND_DEPS}/venv/bin/python")
  set(Python_EXECUTABLE "${STEADYHAND_DEPS}/venv/bin/python")
endif()
find_package(Python 3.10 REQUIRED COMPONENTS Interpreter Development.Module)
execute_process(COMMAND "${Python_EXECUTABLE}" -m nanobind --cmake_dir OUTPUT_STRIP_TRAILING_WHITESPACE OUTPUT_VARIABLE nanobind_ROOT
                RESULT_VARIABLE without_nanobind ERROR_QUIET)
if(without_nanobind)
  message(FATAL_ERROR "${Python_EXECUTABLE} has no nanobind: run ./steadyhand python --version once, which installs it, or build with "
                      "STEADYHAND_WITH_PYTHON=OFF")
endif()
find_package(nanobind CONFIG REQUIRED)

set(python_package "${PROJECT_BINARY_DIR}/python/steadyhand")
file(GLOB python_sources CONFIGURE_DEPENDS src/steadyhand/apps/python/*.cpp)
nanobind_add_module(steadyhand_module NB_STATIC NOMINSIZE ${python_sources})
set_target_properties(steadyhand_module PROPERTIES OUTPUT_NAME _native LIBRARY_OUTPUT_DIRECTORY "${python_package}")
target_link_libraries(steadyhand_module PRIVATE steadyhand_commands steadyhand_driver)
if(TARGET steadyhand_simulate)
  target_link_libraries(steadyhand_module PRIVATE steadyhand_simulate)
endif()
# Not ours: its headers and its library warn.
target_include_directories(steadyhand_module SYSTEM PRIVATE "$<TARGET_PROPERTY:nanobind-static,INTERFACE_INCLUDE_DIRECTORIES>")
target_compile_options(nanobind-static PRIVATE -w)
target_compile_options(steadyhand_module PRIVATE ${STEADYHAND_COLD_OPTIONS})
target_precompile_headers(steadyhand_module PRIVATE <nanobind/nanobind.h> <nanobind/ndarray.h> <Eigen/Core> <Eigen/Geometry>
                          <fmt/format.h> <algorithm> <cmath> <filesystem> <functional> <memory> <optional> <string> <vector>)

nanobind_add_stub(steadyhand_stub MODULE _native OUTPUT "${python_package}/_native.pyi" PYTHON_PATH "${python_package}"
                  DEPENDS steadyhand_module)

file(GLOB python_files CONFIGURE_DEPENDS RELATIVE "${PROJECT_SOURCE_DIR}/python/steadyhand" python/steadyhand/*.py
     python/steadyhand/py.typed)
file(MAKE_DIRECTORY "${python_package}")
foreach(file ${python_files})
  file(CREATE_LINK "${PROJECT_SOURCE_DIR}/python/steadyhand/${file}" "${python_package}/${file}" SYMBOLIC)
endforeach()
foreach(folder dataset policies score study)
  file(CREATE_LINK "${PROJECT_SOURCE_DIR}/python/steadyhand/${folder}" "${python_package}/${folder}" SYMBOLIC)
endforeach()

if(STEADYHAND_PROCESSORS)
  set_target_properties(steadyhand_module PROPERTIES BUILD_RPATH "$ORIGIN/lib" INSTALL_RPATH "$ORIGIN/lib")
endif()
if(NOT SKBUILD)
  return()
endif()

# What goes into the wheel beside python/steadyhand (pyproject.toml).
install(TARGETS steadyhand_module LIBRARY DESTINATION steadyhand COMPONENT python)
install(FILES "${python_package}/_native.pyi" DESTINATION steadyhand COMPONENT python)
install(DIRECTORY robots cells profiles tasks DESTINATION steadyhand/share/steadyhand COMPONENT python FILES_MATCHING PATTERN "*.yaml" PATTERN "*.xml")
foreach(level ${STEADYHAND_PROCESSORS})
  add_dependencies(steadyhand_module steadyhand_hot_${level})
  list(FIND STEADYHAND_PROCESSORS ${level} place)
  if(place EQUAL 0)
    install(TARGETS steadyhand_hot_${level} LIBRARY DESTINATION steadyhand/lib COMPONENT python)
  else()
    install(TARGETS steadyhand_hot_${level} LIBRARY DESTINATION steadyhand/lib/glibc-hwcaps/${level} COMPONENT python)
  endif()
endforeach()
