#include "profile/profile.hpp"

#include <algorithm>
#include <map>
#include <string_view>

#include "base/number_table.hpp"
#include "base/output_file.hpp"
#include "base/tool_error.hpp"
#include "profile/function_name.hpp"

namespace cairn::ground {
namespace {

/// One line, field by field.
class Line {
 public:
  Line(const std::string& path, int number, std::string_view text)
      : path_(path), number_(number), fields_(split(text, '\t')) {}
  std::string_view kind() const { return fields_.front(); }
  bool more() const { return next_ < fields_.size(); }
  std::string word() {
    if (!more()) fail("is too short");
    return std::string(fields_[next_++]);
  }
  template <typename T>
  T number() {
    const std::string text = word();
    const std::optional<T> value = to_number<T>(text);
    if (!value) fail("'" + text + "' is not a number");
    return *value;
  }
  ProfileCost cost() {
    const auto instructions = number<std::uint64_t>();
    return {instructions, number<std::uint64_t>()};
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw ToolError("{}:{}: {}; run `make profile` again", path_, number_, why);
  }

 private:
  const std::string& path_;
  int number_;
  std::vector<std::string_view> fields_;
  std::size_t next_ = 1;
};

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path.string()) {
    const std::vector<std::uint8_t> bytes = read_file(path);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::size_t at = 0;
    int number = 0;
    while (at < text.size() && !ended_) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      Line line(path_, ++number, text.substr(at, end - at));
      if (number == 1 && (line.kind() != "cairn-profile" || line.number<int>() != 1))
        throw ToolError("{}: is not a profile of this version; run `make profile` again", path_);
      take(line);
      at = end + 1;
    }
    if (!ended_) throw ToolError("{}: is cut off; run `make profile` again", path_);
    finish();
  }
  Profile take_profile() { return std::move(out_); }

 private:
  void take(Line& line) {
    const std::string_view kind = line.kind();
    if (kind == "processor") out_.processor = line.word();
    if (kind == "clock_mhz") out_.clock_mhz = line.number<double>();
    if (kind == "total") out_.total = line.cost();
    if (kind == "classes") {
      while (line.more()) out_.classes.push_back(line.word());
    }
    if (kind == "function") function(line);
    if (kind == "node") node(line);
    if (kind == "frame") out_.frames.push_back({0, line.number<std::uint64_t>(), line.cost()});
    if (kind == "call") {
      const std::size_t called = index(line);
      const auto at = line.number<std::uint64_t>();
      out_.calls.push_back({called, at, line.cost()});
    }
    if (kind == "detail") out_.detail_frame = line.number<long>();
    if (kind == "end") ended_ = true;
  }
  void function(Line& line) {
    index_[line.number<int>()] = out_.functions.size();
    ProfileFunction f;
    const std::string linked = line.word();
    f.name = profile::short_name(linked);
    f.plain = profile::is_fragment(linked) ? "" : profile::plain_name(linked);
    f.calls = line.number<std::uint64_t>();
    f.inclusive = line.cost();
    f.longest = line.cost();
    f.fetch_misses = line.number<std::uint64_t>();
    f.data_misses = line.number<std::uint64_t>();
    f.stalled_cycles = line.number<std::uint64_t>();
    while (line.more()) f.counts.push_back(line.number<std::uint64_t>());
    if (f.counts.size() != out_.classes.size()) line.fail("does not have one count per class");
    out_.functions.push_back(std::move(f));
  }
  std::size_t index(Line& line) {
    const auto at = index_.find(line.number<int>());
    if (at == index_.end()) line.fail("refers to a function that is not in the file");
    return at->second;
  }
  void node(Line& line) {
    ProfileNode n;
    if (line.number<std::size_t>() != out_.nodes.size()) line.fail("is out of order");
    n.parent = line.number<std::size_t>();
    if (n.parent >= std::max<std::size_t>(1, out_.nodes.size())) line.fail("comes before its caller");
    if (out_.nodes.empty() && index_.count(0) == 0) {
      index_[0] = out_.functions.size();
      ProfileFunction root;
      root.name = "(elsewhere)";
      root.counts.assign(out_.classes.size(), 0);
      out_.functions.push_back(root);
    }
    n.function = index(line);
    n.calls = line.number<std::uint64_t>();
    n.self = line.cost();
    n.detail_calls = line.number<std::uint64_t>();
    n.detail_self = line.cost();
    out_.nodes.push_back(n);
  }
  void finish() {
    if (out_.nodes.empty() || !(out_.clock_mhz > 0.0))
      throw ToolError("{}: contains no run; run `make profile` again", path_);
    for (const ProfileNode& n : out_.nodes) {
      ProfileFunction& f = out_.functions[n.function];
      f.self += n.self;
      f.detail_self += n.detail_self;
      f.detail_calls += n.detail_calls;
    }
    std::stable_sort(out_.calls.begin(), out_.calls.end(),
                     [](const ProfileSpan& a, const ProfileSpan& b) { return a.at < b.at; });
  }

  std::string path_;
  Profile out_;
  std::map<int, std::size_t> index_;  // by the plugin's number
  bool ended_ = false;
};

}  // namespace

Profile read_profile(const std::filesystem::path& path) { return Reader(path).take_profile(); }

}  // namespace cairn::ground
