// A configuration with all its keys, defaults included, as JSON: for manifests, hashes and files that state everything.
#pragma once

#include <nlohmann/json.hpp>

#include "core/config.h"

namespace plumbline::core {

enum class PathForm {
  kPath,
  kContentHash,  // "xxh3:" and the hash of the file, so that where files lie does not change a configuration's hash
};

namespace detail {
nlohmann::ordered_json resolve(const Visit& visit_config, PathForm form);
}  // namespace detail

// All keys with their values. The dump of the result is input for parse_config and reads back to the bit.
template <class Config>
nlohmann::ordered_json resolved_config(const Config& c, PathForm form = PathForm::kPath) {
  Config copy = c;
  return detail::resolve([&copy](ConfigVisitor& v) { visit(v, copy); }, form);
}

}  // namespace plumbline::core
