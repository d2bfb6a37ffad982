# cmake -DSOURCE=FOLDER -DOUT=FILE -P commit.cmake: the commit of FOLDER as C++, for `steadyhand --version`. OUT is written only if
# it changes. In an archive of `git archive` the commit is what Git puts below (.gitattributes).
cmake_minimum_required(VERSION 3.25)
set(commit "$Format:%h$")
if(EXISTS "${SOURCE}/.git")  # not that of a repository around it
  execute_process(COMMAND git -C "${SOURCE}" describe --always --dirty "--exclude=*" OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT commit MATCHES "^[0-9a-f]+(-dirty)?$")
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT "${OUT}" CONTENT "#include \"steadyhand/apps/commands/version.hpp\"\n\nconst char* const steadyhand::kCommit = \"${commit}\";\n")
