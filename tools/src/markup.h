// Text inside HTML and XML.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::tools {

// As content or as an attribute in double quotes.
inline std::string escape_markup(std::string_view plain) {
  std::string text;
  for (const char c : plain) {
    switch (c) {
      case '&':
        text += "&amp;";
        break;
      case '<':
        text += "&lt;";
        break;
      case '>':
        text += "&gt;";
        break;
      case '"':
        text += "&quot;";
        break;
      default:
        text += c;
    }
  }
  return text;
}

}  // namespace plumbline::tools
