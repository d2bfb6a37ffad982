# The session as one WebAssembly module, steadyhand.wasm, for a page's Worker (web/src/worker/). Of the parts' objects rather than
# of archives: GNU ar, which is always there, makes none that wasm-ld reads.
add_executable(steadyhand_wasm)
set_target_properties(steadyhand_wasm PROPERTIES OUTPUT_NAME steadyhand SUFFIX .wasm)
foreach(part core collision robot retarget predict liquid ocp solve plan pipeline supervise live driver input record archive protocol browser)
  target_sources(steadyhand_wasm PRIVATE "$<TARGET_OBJECTS:steadyhand_${part}>")
endforeach()
target_link_options(steadyhand_wasm PRIVATE -Wl,-z,stack-size=4194304,--stack-first,--gc-sections,--strip-all)
