#pragma once
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/files/text_file.h"

namespace unrig::test {

/// What the page at `path` draws from.
inline nlohmann::json page_data(const std::string& path) {
  const std::string html = read_text(path), open = "id=\"report-data\">";
  const std::size_t first = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(first, html.find("</script>", first) - first));
}

/// Its blocks of a type, in their order.
inline std::vector<nlohmann::json> blocks(const nlohmann::json& data, const std::string& type) {
  std::vector<nlohmann::json> found;
  for (const nlohmann::json& block : data["blocks"])
    if (block["type"] == type) found.push_back(block);
  return found;
}

/// The plot with a title; none: nullptr.
inline const nlohmann::json* plot_titled(const nlohmann::json& data, const std::string& title) {
  for (const nlohmann::json& block : data["blocks"])
    if (block["type"] == "plot" && block["title"] == title) return &block;
  return nullptr;
}

}  // namespace unrig::test
