# steadyhand_embed_folder(PART FOLDER): compiles every file below FOLDER into the part's library; embedded_page() of
# server/embedded_page.hpp lists them. With a third argument, a file that is newer than FOLDER's files.
function(steadyhand_embed_folder part folder)
  get_filename_component(folder "${folder}" ABSOLUTE)
  set(output "${PROJECT_BINARY_DIR}/embedded/${part}_folder.cpp")
  if(ARGN)
    set(inputs ${ARGN})
  else()
    file(GLOB_RECURSE inputs CONFIGURE_DEPENDS "${folder}/*")
  endif()
  set(script "${PROJECT_SOURCE_DIR}/cmake/embed_files.cmake")
  add_custom_command(
    OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" -DOUTPUT=${output} -DFOLDER=${folder} -P "${script}"
    DEPENDS ${inputs} "${script}"
    COMMENT "Embedding ${folder}" VERBATIM)
  target_sources(steadyhand_${part} PRIVATE "${output}")
endfunction()
