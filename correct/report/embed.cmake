# cmake -DDYGRAPHS=dygraph.min.js -DFOLDER=here -DOUTPUT=page.cpp -P embed.cmake
# Puts style, script and dygraphs into page.html, and the page into a C++ file as the string `report_page_template`.
get_filename_component(dygraphs_folder "${DYGRAPHS}" DIRECTORY)
file(READ "${FOLDER}/page.html" page)
file(READ "${FOLDER}/page.css" style)
file(READ "${FOLDER}/page.js" script)
file(READ "${DYGRAPHS}" dygraphs)
file(READ "${dygraphs_folder}/dygraph.min.css" dygraphs_style)
foreach(text dygraphs dygraphs_style)  # browsers would look for the source maps
  string(REGEX REPLACE "//# sourceMappingURL=[^\n]*" "" ${text} "${${text}}")
  string(REGEX REPLACE "/\\*# sourceMappingURL=[^\n]*" "" ${text} "${${text}}")
endforeach()
string(REPLACE "/*UNRIG_STYLE*/" "${dygraphs_style}\n${style}" page "${page}")
string(REPLACE "/*UNRIG_DYGRAPHS*/" "${dygraphs}" page "${page}")
string(REPLACE "/*UNRIG_SCRIPT*/" "${script}" page "${page}")
file(WRITE "${OUTPUT}" "#include \"correct/report/report_page.h\"\n\nnamespace unrig {\n\nconst char* const report_page_template = R\"unrig_page(${page})unrig_page\";\n\n}  // namespace unrig\n")
