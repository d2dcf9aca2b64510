#include "commands/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "base/number_table.hpp"
#include "base/output_file.hpp"

namespace cairn::ground {
namespace {

constexpr const char* kWritten = "written";

bool is_written(CLI::Option* option) {
  try {
    return option->get_validator(kWritten) != nullptr;
  } catch (const CLI::OptionNotFound&) {
    return false;
  }
}

std::string at_least_zero(const std::string& text, bool zero) {
  const std::optional<double> value = to_number<double>(text);
  if (value && (*value > 0.0 || (zero && *value >= 0.0))) return {};
  return fmt::format("{} is not a {}", text, zero ? "number of 0 or more" : "positive number");
}

/// 1.5k becomes 1500, 2Mi 2097152; what is wrong with it, if anything is.
std::string read_size(std::string& text) {
  constexpr std::string_view kUnits = "kmgt";
  std::string unit = text.substr(std::min(text.find_first_not_of("+-.0123456789"), text.size()));
  const std::optional<double> number = to_finite(std::string_view(text).substr(0, text.size() - unit.size()));
  for (char& c : unit) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (!unit.empty() && unit.back() == 'b') unit.pop_back();
  const std::size_t power = unit.empty() ? 0 : kUnits.find(unit[0]) + 1;
  const bool binary = unit.size() == 2 && unit[1] == 'i';
  const bool known = unit.empty() || (power > 0 && (unit.size() == 1 || binary));
  const double bytes = number.value_or(0.0) * std::pow(binary ? 1024.0 : 1000.0, static_cast<double>(power));
  if (!known || !(bytes >= 1.0) || bytes > 4294967295.0)
    return text + " is no number of bytes; give one like 300, 1.5k, 20ki or 1M";
  text = fmt::format("{:.0f}", std::floor(bytes));
  return {};
}

/// An input that is an output, too, would be gone.
void check_written(CLI::App& command) {
  for (const CLI::Option* to : command.get_options(is_written)) {
    for (const CLI::Option* other : command.get_options()) {
      if (other == to || to->count() == 0) continue;
      for (const std::string& value : other->results()) {
        if (value.empty() || !same_file(to->results().front(), value)) continue;
        throw CLI::ValidationError(to->get_name(),
                                   value + " is given as " + other->get_name() +
                                       ", too, and would be overwritten; choose another name");
      }
    }
  }
}

}  // namespace

OptionRules& OptionRules::required() {
  option_->required();
  return *this;
}
OptionRules& OptionRules::within(int least, int most) {
  option_->check(CLI::Range(least, most));
  return *this;
}
OptionRules& OptionRules::within(double least, double most) {
  option_->check(CLI::Range(least, most));
  return *this;
}
OptionRules& OptionRules::positive() {
  // CLI11's own rule tells the range up to its last of 300 digits.
  option_->check([](const std::string& text) { return at_least_zero(text, false); }, "POSITIVE");
  return *this;
}
OptionRules& OptionRules::not_negative() {
  option_->check([](const std::string& text) { return at_least_zero(text, true); }, "NONNEGATIVE");
  return *this;
}
OptionRules& OptionRules::one_of(std::initializer_list<std::string> words) {
  option_->check(CLI::IsMember(std::vector<std::string>(words)));
  return *this;
}
OptionRules& OptionRules::in_bytes() {
  option_->transform(CLI::Validator(read_size, "BYTES"));
  return *this;
}
OptionRules& OptionRules::values(int least, int most) {
  option_->expected(least, most);
  return *this;
}
OptionRules& OptionRules::separated_by(char mark) {
  option_->delimiter(mark);
  return *this;
}
OptionRules& OptionRules::written() {
  option_->check([](const std::string&) { return std::string(); }, "", kWritten);
  return *this;
}
OptionRules& OptionRules::needs(const std::string& other) {
  option_->needs(other);
  return *this;
}
OptionRules& OptionRules::excludes(const std::string& other) {
  option_->excludes(other);
  return *this;
}
OptionRules& OptionRules::default_shown() {
  option_->capture_default_str();
  return *this;
}
OptionRules& OptionRules::group(const std::string& heading) {
  option_->group(heading);
  return *this;
}

Command Command::add_command(const std::string& name, const std::string& text) const {
  return Command(*app_->add_subcommand(name, text));
}
void Command::require_command() const { app_->require_subcommand(1); }
void Command::on_run(std::function<void()> run) const {
  app_->callback([app = app_, run = std::move(run)] {
    check_written(*app);
    run();
  });
}

template <typename T>
OptionRules Command::add_option(const std::string& names, T& into, const std::string& text) const {
  return OptionRules(app_->add_option(names, into, text));
}
#define OPTION_OF(...) \
  template OptionRules Command::add_option(const std::string&, __VA_ARGS__&, const std::string&) const
OPTION_OF(double);
OPTION_OF(int);
OPTION_OF(unsigned);
OPTION_OF(unsigned short);
OPTION_OF(unsigned long);
OPTION_OF(std::optional<unsigned>);
OPTION_OF(std::string);
OPTION_OF(std::filesystem::path);
OPTION_OF(std::vector<double>);
OPTION_OF(std::vector<std::string>);
OPTION_OF(std::vector<std::filesystem::path>);
#undef OPTION_OF

OptionRules Command::add_taken(const std::string& names, std::function<void(const std::string&)> take,
                               const std::string& text) const {
  return OptionRules(app_->add_option_function<std::string>(names, take, text)->trigger_on_parse());
}
OptionRules Command::add_taken(const std::string& names, std::function<void(double)> take,
                               const std::string& text) const {
  return OptionRules(app_->add_option_function<double>(
                             names, [take](const double& value) { take(value); }, text)
                         ->trigger_on_parse());
}
OptionRules Command::add_flag(const std::string& names, bool& into, const std::string& text) const {
  return OptionRules(app_->add_flag(names, into, text));
}

}  // namespace cairn::ground
