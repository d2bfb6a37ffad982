# The operator's page (web/) and the report's, of the same sources, bundled by Vite: into build/PRESET/page, and as one file.
# Without them pages that say so.
set(vite_script "${STEADYHAND_DEPS}/node_modules/vite/bin/vite.js")
find_program(NODE_PROGRAM NAMES node nodejs)
if(STEADYHAND_WITH_PAGE AND NOT (NODE_PROGRAM AND EXISTS "${vite_script}"))
  message(WARNING "Without the page, the plots of reports and the bundled hands: no Node, or no ${vite_script}. "
                  "`python3 setup/install.py` installs what is missing; then configure again. STEADYHAND_WITH_PAGE=OFF silences this.")
  set(STEADYHAND_WITH_PAGE OFF)
endif()
if(NOT STEADYHAND_WITH_PAGE)
  set(page_folder "${PROJECT_SOURCE_DIR}/cmake/without_page")
  set(page_stamp "${page_folder}/index.html")
  set(report_page "${PROJECT_SOURCE_DIR}/cmake/without_page/report.html")
  return()
endif()
# Node looks for packages in the folders above a file.
file(CREATE_LINK "${STEADYHAND_DEPS}/node_modules" "${PROJECT_SOURCE_DIR}/web/node_modules" SYMBOLIC)

set(page_folder "${PROJECT_BINARY_DIR}/page")
set(page_stamp "${PROJECT_BINARY_DIR}/page.stamp")

file(GLOB_RECURSE page_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/web/src/*")
list(APPEND page_sources "${PROJECT_SOURCE_DIR}/web/vite.config.mts" "${PROJECT_SOURCE_DIR}/setup/package-lock.json")
set(vite "${NODE_PROGRAM}" "${vite_script}")
add_custom_command(
  OUTPUT "${page_stamp}"
  COMMAND "${CMAKE_COMMAND}" -E env STEADYHAND_PAGE=${page_folder}
          ${vite} build --logLevel warn
  COMMAND "${CMAKE_COMMAND}" -E touch "${page_stamp}"
  DEPENDS ${page_sources} "${PROJECT_SOURCE_DIR}/web/index.html"
  WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}/web"
  COMMENT "Bundling the operator's page" VERBATIM)

set(report_page "${PROJECT_BINARY_DIR}/report/report.html")
add_custom_command(
  OUTPUT "${report_page}"
  COMMAND "${CMAKE_COMMAND}" -E env STEADYHAND_PAGE=${PROJECT_BINARY_DIR}/report ${vite} build --mode report --logLevel warn
  DEPENDS ${page_sources} "${PROJECT_SOURCE_DIR}/web/report.html"
  WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}/web"
  COMMENT "Bundling the report's page" VERBATIM)
