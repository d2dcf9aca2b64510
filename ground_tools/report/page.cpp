#include "report/page.hpp"

#include <fmt/format.h>

#include <map>
#include <set>

#include "plot/single_page.hpp"

CAIRN_EMBED(cairn_report_html, "ground_tools/report/report.html");
CAIRN_EMBED(cairn_report_css, "ground_tools/report/report.css");
CAIRN_EMBED(cairn_run_js, "ground_tools/report/run.js");
CAIRN_EMBED(cairn_chart_js, "ground_tools/report/chart.js");
CAIRN_EMBED(cairn_map_js, "ground_tools/report/map.js");
CAIRN_EMBED(cairn_pictures_js, "ground_tools/report/pictures.js");
CAIRN_EMBED(cairn_report_js, "ground_tools/report/report.js");

namespace cairn::ground {
namespace {

using nlohmann::ordered_json;

/// Pictures are kept once: runs over the same frames show the same ones.
class PictureStore {
 public:
  /// Replaces the base64 text by its number in the store; an empty one by -1.
  void take(ordered_json& jpeg) {
    const auto text = jpeg.get<std::string>();
    if (text.empty()) {
      jpeg = -1;
      return;
    }
    const auto [at, fresh] = numbers_.emplace(text, numbers_.size());
    if (fresh) pictures_.push_back(text);
    jpeg = at->second;
  }
  const ordered_json& pictures() const { return pictures_; }

 private:
  std::map<std::string, std::size_t> numbers_;
  ordered_json pictures_ = ordered_json::array();
};

void make_names_differ(std::vector<ordered_json>& runs) {
  std::set<std::string> taken;
  for (ordered_json& run : runs) {
    const auto name = run.at("name").get<std::string>();
    std::string tried = name;
    for (int i = 2; !taken.insert(tried).second; ++i) tried = fmt::format("{} ({})", name, i);
    run["name"] = tried;
  }
}

}  // namespace

std::string report_page(std::vector<ordered_json> runs) {
  make_names_differ(runs);
  PictureStore store;
  for (ordered_json& run : runs) {
    if (!run.at("ortho").is_null()) store.take(run["ortho"].at("jpeg"));
    for (ordered_json& strip : run["strips"]) {
      for (ordered_json& picture : strip) store.take(picture.at("jpeg"));
    }
  }
  const ordered_json data = {{"runs", runs}, {"pictures", store.pictures()}};
  const std::string script =
      std::string(cairn_run_js) + cairn_chart_js + cairn_map_js + cairn_pictures_js + cairn_report_js;
  return single_page({"Cairn report", cairn_report_css, cairn_report_html, script}, data);
}

}  // namespace cairn::ground
