# cmake -DOUTPUT=out.cpp -DNAME=name -DFILE=text -P embed_text.cmake: the text as `extern const std::string_view name` in
# namespace steadyhand::embedded.
file(READ "${FILE}" text)
set(source "#include <string_view>
namespace steadyhand::embedded {
extern const std::string_view ${NAME};
const std::string_view ${NAME} = R\"~embedded~(")
string(APPEND source "${text}" ")~embedded~\";\n}  // namespace steadyhand::embedded\n")
file(WRITE "${OUTPUT}" "${source}")
