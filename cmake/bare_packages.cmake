# Third-party packages where there is no operating system: those that are headers only, each by itself, since what stands beside
# them in /usr/include is the host's.
set(bare_headers "${PROJECT_BINARY_DIR}/bare_headers")
file(MAKE_DIRECTORY "${bare_headers}")
foreach(package fmt nlohmann)
  find_path(${package}_headers ${package} PATHS /usr/include NO_DEFAULT_PATH REQUIRED NO_CMAKE_FIND_ROOT_PATH)
  file(CREATE_LINK "${${package}_headers}/${package}" "${bare_headers}/${package}" SYMBOLIC)
endforeach()
find_path(eigen_headers Eigen/Core PATHS /usr/include/eigen3 NO_DEFAULT_PATH REQUIRED NO_CMAKE_FIND_ROOT_PATH)

add_library(Eigen3::Eigen INTERFACE IMPORTED)
target_include_directories(Eigen3::Eigen SYSTEM INTERFACE "${eigen_headers}")
add_library(fmt::fmt INTERFACE IMPORTED)
target_include_directories(fmt::fmt SYSTEM INTERFACE "${bare_headers}")
target_compile_definitions(fmt::fmt INTERFACE FMT_HEADER_ONLY)
add_library(nlohmann_json::nlohmann_json INTERFACE IMPORTED)
target_include_directories(nlohmann_json::nlohmann_json SYSTEM INTERFACE "${bare_headers}")
target_compile_definitions(nlohmann_json::nlohmann_json INTERFACE JSON_HAS_FILESYSTEM=0 JSON_HAS_EXPERIMENTAL_FILESYSTEM=0)
