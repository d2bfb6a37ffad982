# The operator's page (web/), bundled by Vite into build/PRESET/page; and what the report's plots are drawn with. Without it a page that says so.
if(NOT STEADYHAND_WITH_PAGE)
  set(page_folder "${PROJECT_SOURCE_DIR}/cmake/without_page")
  set(page_stamp "${page_folder}/index.html")
  set(uplot_js "${PROJECT_SOURCE_DIR}/cmake/without_page/uplot.js")
  set(uplot_css "${PROJECT_BINARY_DIR}/empty.cpp")
  return()
endif()
set(uplot_js "${STEADYHAND_DEPS}/node_modules/uplot/dist/uPlot.iife.min.js")
set(uplot_css "${STEADYHAND_DEPS}/node_modules/uplot/dist/uPlot.min.css")
find_program(NODE_PROGRAM NAMES node nodejs REQUIRED)
if(NOT EXISTS "${STEADYHAND_DEPS}/node_modules/vite/bin/vite.js")
  message(FATAL_ERROR "Vite not found under ${STEADYHAND_DEPS}: run ./steadyhand once, it installs the pinned packages")
endif()
# Node looks for packages in the folders above a file.
file(CREATE_LINK "${STEADYHAND_DEPS}/node_modules" "${PROJECT_SOURCE_DIR}/web/node_modules" SYMBOLIC)

set(page_folder "${PROJECT_BINARY_DIR}/page")
set(page_stamp "${PROJECT_BINARY_DIR}/page.stamp")

file(GLOB_RECURSE page_sources CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/web/src/*")
add_custom_command(
  OUTPUT "${page_stamp}"
  COMMAND "${CMAKE_COMMAND}" -E env STEADYHAND_PAGE=${page_folder}
          "${NODE_PROGRAM}" "${STEADYHAND_DEPS}/node_modules/vite/bin/vite.js" build --logLevel warn
  COMMAND "${CMAKE_COMMAND}" -E touch "${page_stamp}"
  DEPENDS ${page_sources} "${PROJECT_SOURCE_DIR}/web/index.html" "${PROJECT_SOURCE_DIR}/web/vite.config.mts"
          "${PROJECT_SOURCE_DIR}/setup/package-lock.json"
  WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}/web"
  COMMENT "Bundling the operator's page" VERBATIM)
