# The Python package: the module steadyhand._native (src/steadyhand/apps/python), and beside it python/steadyhand, so that
# PYTHONPATH=build/PRESET/python imports it.
if(NOT SKBUILD AND NOT Python_EXECUTABLE AND EXISTS "${STEADYHAND_DEPS}/venv/bin/python")
  set(Python_EXECUTABLE "${STEADYHAND_DEPS}/venv/bin/python")
endif()
find_package(Python 3.10 REQUIRED COMPONENTS Interpreter Development.Module ${SKBUILD_SABI_COMPONENT})
execute_process(COMMAND "${Python_EXECUTABLE}" -m nanobind --cmake_dir OUTPUT_STRIP_TRAILING_WHITESPACE OUTPUT_VARIABLE nanobind_ROOT
                RESULT_VARIABLE without_nanobind ERROR_QUIET)
if(without_nanobind)
  message(FATAL_ERROR "${Python_EXECUTABLE} has no nanobind: run ./steadyhand python --version once, which installs it, or build with "
                      "STEADYHAND_WITH_PYTHON=OFF")
endif()
find_package(nanobind CONFIG REQUIRED)

set(python_package "${PROJECT_BINARY_DIR}/python/steadyhand")
file(GLOB python_sources CONFIGURE_DEPENDS src/steadyhand/apps/python/*.cpp)
# STABLE_ABI: from Python 3.12 on; of an older one the module is for this version alone.
nanobind_add_module(steadyhand_module NB_STATIC NOMINSIZE STABLE_ABI ${python_sources})
set_target_properties(steadyhand_module PROPERTIES OUTPUT_NAME _native LIBRARY_OUTPUT_DIRECTORY "${python_package}")
target_link_libraries(steadyhand_module PRIVATE steadyhand_replay steadyhand_figures steadyhand_driver)
if(TARGET steadyhand_simulate)
  target_link_libraries(steadyhand_module PRIVATE steadyhand_simulate)
endif()
# Not ours: its headers and its library warn.
foreach(nanobind nanobind-static nanobind-static-abi3)
  if(TARGET ${nanobind})
    target_include_directories(steadyhand_module SYSTEM PRIVATE "$<TARGET_PROPERTY:${nanobind},INTERFACE_INCLUDE_DIRECTORIES>")
    target_compile_options(${nanobind} PRIVATE -w)
  endif()
endforeach()
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

if(SKBUILD)  # what else the wheel has: python/steadyhand, and the component runtime of cmake/install.cmake
  install(TARGETS steadyhand_module LIBRARY DESTINATION . COMPONENT python)
  install(FILES "${python_package}/_native.pyi" DESTINATION . COMPONENT python)
  set_target_properties(steadyhand_module PROPERTIES INSTALL_RPATH "$ORIGIN/${CMAKE_INSTALL_LIBDIR}")
  # Licences of the libraries of Debian that auditwheel puts into it (THIRD_PARTY.md).
  foreach(package libacl1 libassimp5 libconsole-bridge1.0 libddsc0debian libdraco7 libfmt9 libiceoryx-posh2 libminizip1 libqrencode4 libssl3
                  libtinyxml2.6.2v5 libtinyxml2-9 liburdfdom-model3.0 libyaml-cpp0.7 libzstd1)
    install(FILES "/usr/share/doc/${package}/copyright" DESTINATION share/licenses RENAME ${package} COMPONENT python OPTIONAL)
  endforeach()
endif()
