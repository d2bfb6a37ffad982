# steadyhand_embed(PART name=file...): compiles text files into the part's library as std::string_view
# steadyhand::embedded::name, so that the program needs no files beside it.
function(steadyhand_embed part)
  foreach(pair ${ARGN})
    string(REGEX MATCH "^([a-z_]+)=(.+)$" matched "${pair}")
    set(name "${CMAKE_MATCH_1}")
    get_filename_component(file "${CMAKE_MATCH_2}" ABSOLUTE)
    set(output "${PROJECT_BINARY_DIR}/embedded/${part}_${name}.cpp")
    add_custom_command(
      OUTPUT "${output}"
      COMMAND "${CMAKE_COMMAND}" -DOUTPUT=${output} -DNAME=${name} -DFILE=${file} -P "${PROJECT_SOURCE_DIR}/cmake/embed_text.cmake"
      DEPENDS "${file}" "${PROJECT_SOURCE_DIR}/cmake/embed_text.cmake"
      COMMENT "Embedding ${name}" VERBATIM)
    target_sources(steadyhand_${part} PRIVATE "${output}")
  endforeach()
endfunction()
