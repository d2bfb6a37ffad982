# MuJoCo's headers, of the PyPI package mujoco-core (setup/requirements-mujoco.txt), where that is installed. Its library is loaded
# at run time. Without it the rest builds all the same, and `--arm mujoco` says what to install.
set(mujoco_folder "${site_packages}/mujoco")
file(GLOB mujoco_library "${mujoco_folder}/libmujoco.so.*")
if(mujoco_library AND EXISTS "${mujoco_folder}/include/mujoco/mujoco.h")
  set(STEADYHAND_MUJOCO ON)
  add_library(mujoco INTERFACE IMPORTED)
  target_include_directories(mujoco SYSTEM INTERFACE "${mujoco_folder}/include")
else()
  set(STEADYHAND_MUJOCO OFF)
  message(STATUS "Without MuJoCo: mujoco-core is not installed in ${STEADYHAND_DEPS}/venv")
endif()
