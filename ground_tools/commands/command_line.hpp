/// A command of the program with its options, as its file sets them. CLI11 is behind, in command_line.cpp and
/// cairn.cpp alone: it is read and made anew by each file that sees it.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace cairn::ground {

/// Ends a command that worked and whose answer is not yes, with this exit status.
struct Answer {
  int status;
};

/// What else is asked of an option, each in a word; ends in an error of one line where it is not met.
class OptionRules {
 public:
  explicit OptionRules(CLI::Option* option) : option_(option) {}
  OptionRules& required();
  OptionRules& within(int least, int most);
  OptionRules& within(double least, double most);
  OptionRules& positive();
  OptionRules& not_negative();
  OptionRules& one_of(std::initializer_list<std::string> words);
  /// Bytes, one or more: 300, 1.5k (1,500), 20ki (20,480); m, g and t likewise, in small letters or capitals.
  OptionRules& in_bytes();
  /// How many values in a row, 1 where not told.
  OptionRules& values(int least, int most);
  OptionRules& separated_by(char mark);
  /// The command writes this file: another option of it may not name the same one.
  OptionRules& written();
  OptionRules& needs(const std::string& other);
  OptionRules& excludes(const std::string& other);
  /// The variable's present value is told by --help.
  OptionRules& default_shown();
  /// The heading under which --help has it.
  OptionRules& group(const std::string& heading);

 private:
  CLI::Option* option_;
};

class Command {
 public:
  explicit Command(CLI::App& app) : app_(&app) {}
  Command add_command(const std::string& name, const std::string& text) const;
  /// One of its own commands must be given.
  void require_command() const;
  /// What the command does, once all of its options are read.
  void on_run(std::function<void()> run) const;

  /// `names` as "-o,--output", or "file" for one without a dash. T: those that command_line.cpp lists.
  template <typename T>
  OptionRules add_option(const std::string& names, T& into, const std::string& text) const;
  /// Hands each value on to `take`, in the order of the command line; it may throw ToolError.
  OptionRules add_taken(const std::string& names, std::function<void(const std::string&)> take,
                        const std::string& text) const;
  OptionRules add_taken(const std::string& names, std::function<void(double)> take,
                        const std::string& text) const;
  OptionRules add_flag(const std::string& names, bool& into, const std::string& text) const;

 private:
  CLI::App* app_;
};

}  // namespace cairn::ground
