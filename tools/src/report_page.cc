#include <stdexcept>

#include "markup.h"
#include "report_template.h"
#include "tools/report.h"

namespace plumbline::tools {
namespace {

// Neither ends a script element nor opens a comment in one.
std::string for_script(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) c == '<' ? text += "\\u003c" : text += c;
  return text;
}

void replace(std::string& text, std::string_view place, const std::string& by) {
  const std::size_t at = text.find(place);
  if (at == std::string::npos) throw std::logic_error("report page: no place for " + std::string(place));
  text.replace(at, place.size(), by);
}

}  // namespace

std::string report_page(std::string_view title, const nlohmann::ordered_json& data) {
  std::string page(kReportTemplate);
  replace(page, "@TITLE@", escape_markup(title));
  replace(page, "@DATA@", for_script(data.dump()));
  return page;
}

}  // namespace plumbline::tools
