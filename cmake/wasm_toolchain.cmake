# WebAssembly as browsers run it, by clang and the WASI C library of Debian and Ubuntu (setup/apt-wasm.txt). The packages put
# nothing where clang looks for it by itself.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(llvm /usr/lib/llvm-16)
set(CMAKE_CXX_COMPILER ${llvm}/bin/clang++)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
# There is nothing that could catch an exception: what throws one ends the program (browser/exports.cpp says its words).
set(CMAKE_CXX_FLAGS_INIT "-fignore-exceptions -nostdlibinc -isystem ${llvm}/include/wasm32-wasi/c++/v1 -isystem /usr/include/wasm32-wasi")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-mexec-model=reactor -L/usr/lib/wasm32-wasi -L${llvm}/lib/wasm32-wasi")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
# Libraries that are headers only are those of the system.
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)
