cmake_minimum_required(VERSION 3.25)
# Writes OUTPUT, a header with the page of reports: PAGE/page.html with PAGE/page.css and SCRIPT inside.
file(READ ${PAGE}/page.html html)
file(READ ${PAGE}/page.css style)
file(READ ${SCRIPT} script)
string(REPLACE "@STYLE@" "${style}" html "${html}")
string(REPLACE "@SCRIPT@" "${script}" html "${html}")
file(WRITE ${OUTPUT} "#pragma once
#pragma GCC diagnostic ignored \"-Woverlength-strings\"

namespace plumbline::tools {
inline constexpr char kReportTemplate[] = R\"PAGE(${html})PAGE\";
}  // namespace plumbline::tools
")
