# cmake -DOUTPUT=out.cpp -DFOLDER=folder -P embed_files.cmake: the folder's files as bytes, read in by the assembler, and
# steadyhand::embedded_page() with their names.
file(GLOB_RECURSE files RELATIVE "${FOLDER}" "${FOLDER}/*")
list(SORT files)
set(bytes "")
set(symbols "")
set(rows "")
set(i 0)
foreach(name ${files})
  string(APPEND bytes "asm(R\"(.section .rodata
.global steadyhand_file_${i}, steadyhand_file_${i}_end
steadyhand_file_${i}: .incbin \"${FOLDER}/${name}\"
steadyhand_file_${i}_end: .byte 0
.previous)\");\n")
  string(APPEND symbols "extern const char steadyhand_file_${i}[], steadyhand_file_${i}_end[];\n")
  string(APPEND rows "      {\"${name}\", steadyhand_file_${i}, steadyhand_file_${i}_end},\n")
  math(EXPR i "${i} + 1")
endforeach()
file(WRITE "${OUTPUT}" "#include \"steadyhand/operator/server/embedded_page.hpp\"
${bytes}
extern \"C\" {
${symbols}}
namespace steadyhand {
std::vector<EmbeddedFile> embedded_page() {
  return {
${rows}  };
}
}  // namespace steadyhand
")
