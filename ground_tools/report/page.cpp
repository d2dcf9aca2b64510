#include "report/page.hpp"

#include <fmt/format.h>

#include <map>
#include <set>

#include "plot/single_page.hpp"

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
  return single_page("Cairn report", kPageStyle, kPageBody, data, kPageScript);
}

}  // namespace cairn::ground
