# How everything of this project is compiled. Nothing here reaches who links to it but C++20 and Eigen's alignment.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(STEADYHAND_WITH_SYSTEM)
  add_compile_options(-fPIC)  # of programs too: they share precompiled headers with libraries
endif()
get_property(several_build_types GLOBAL PROPERTY GENERATOR_IS_MULTI_CONFIG)
if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT several_build_types)
  set(CMAKE_BUILD_TYPE Release)
endif()

add_compile_options(-Wall -Wextra -Wpedantic -Wshadow $<$<BOOL:${STEADYHAND_WERROR}>:-Werror>)
# gcc 12 and 13 see these where there is nothing, in inlined std::string and Eigen code.
add_compile_options(-Wno-array-bounds -Wno-restrict -Wno-maybe-uninitialized -Wno-stringop-overflow -Wno-stringop-overread)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(-fno-semantic-interposition)  # nobody replaces our functions: they may be inlined
  # gcc 12 sees one in its own AVX-512 header.
  if(CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    add_compile_options(-Wno-uninitialized)
  else()
    # gcc 13 holds every function that takes a temporary string and returns a reference for one that returns into it.
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-Wno-dangling-reference>)
  endif()
elseif(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  add_compile_options(-Wno-unknown-warning-option -Wno-bitwise-instead-of-logical)  # both sides are wanted where we write |
endif()
if(STEADYHAND_PROCESSORS)
  list(GET STEADYHAND_PROCESSORS 0 least_processor)
  add_compile_options(-march=${least_processor})
elseif(STEADYHAND_NATIVE)
  add_compile_options(-march=native)
elseif(STEADYHAND_WASM_SIMD)
  add_compile_options(-msimd128)
endif()
if(STEADYHAND_SANITIZE)
  add_compile_options(-fsanitize=${STEADYHAND_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${STEADYHAND_SANITIZE})
  if(STEADYHAND_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    add_compile_definitions(__SANITIZE_ADDRESS__)  # gcc defines it
  endif()
  if(STEADYHAND_SANITIZE MATCHES thread)
    add_compile_options(-Wno-tsan)  # Asio has fences, which gcc's does not see; it has locks, too
  endif()
endif()

# ccache, where there is one, has what was compiled before, for another checkout, too: paths are relative to its root. Precompiled
# headers take the rest (ccache's manual, "Precompiled headers").
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND PROJECT_IS_TOP_LEVEL AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros
      "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}" CCACHE_NOHASHDIR=1 "${CCACHE_PROGRAM}")
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-fpch-preprocess)
  elseif(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    add_compile_options("SHELL:-Xclang -fno-pch-timestamp")
  endif()
endif()

# The width of the solver's vectors belongs to the library, not to the flags of who includes its headers.
get_directory_property(options COMPILE_OPTIONS)
string(REGEX MATCHALL "-march=[^ ;]+" processor "${options};${CMAKE_CXX_FLAGS}")
execute_process(COMMAND "${CMAKE_CXX_COMPILER}" ${processor} -dM -E -x c++ /dev/null OUTPUT_VARIABLE macros COMMAND_ERROR_IS_FATAL ANY)
if(macros MATCHES "__AVX512F__")
  set(STEADYHAND_LANES 8)
elseif(macros MATCHES "__AVX__")
  set(STEADYHAND_LANES 4)
else()
  set(STEADYHAND_LANES 2)
endif()
configure_file("${PROJECT_SOURCE_DIR}/cmake/configuration.hpp.in" "${PROJECT_BINARY_DIR}/include/steadyhand/core/configuration.hpp")
