#include "profile/function_name.hpp"

#include <cxxabi.h>

#include <cstdlib>

namespace cairn::profile {
namespace {

const std::string kAnonymous = "(anonymous namespace)";

std::string without(std::string text, const std::string& part) {
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part))
    text.erase(at, part.size());
  return text;
}

/// What stands in angle brackets of templates becomes `..`; those of operators stay.
std::string without_template_arguments(const std::string& name) {
  std::string out;
  int depth = 0;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool of_operator = out.size() >= 8 && out.compare(out.size() - 8, 8, "operator") == 0;
    if (depth == 0 && of_operator && (name[i] == '<' || name[i] == '>')) {
      while (i < name.size() && (name[i] == '<' || name[i] == '>' || name[i] == '=')) out += name[i++];
      --i;
    } else if (name[i] == '<') {
      if (depth++ == 0) out += "<..";
    } else if (name[i] == '>' && depth > 0) {
      if (--depth == 0) out += '>';
    } else if (depth == 0) {
      out += name[i];
    }
  }
  return out;
}

/// Where the parameters begin: the first '(' outside template arguments that is none of the name's own.
std::string without_parameters(const std::string& name) {
  int depth = 0;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool of_operator = i >= 8 && name.compare(i - 8, 8, "operator") == 0;
    if (of_operator && name.compare(i, 2, "()") == 0) {
      ++i;
      continue;
    }
    if (name[i] == '<' && !of_operator) ++depth;
    if (name[i] == '>' && depth > 0) --depth;
    if (name[i] == '(' && depth == 0) return name.substr(0, i);
  }
  return name;
}

/// Instances of templates are told with what they return.
std::string without_return_type(const std::string& name) {
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name.compare(i, 8, "operator") == 0) break;
    if (name[i] == '<') ++depth;
    if (name[i] == '>') --depth;
    if (name[i] == ' ' && depth == 0) begin = i + 1;
  }
  return name.substr(begin);
}

}  // namespace

std::string plain_name(const std::string& linked) {
  if (linked.compare(0, 2, "_Z") != 0) return linked.substr(0, linked.find('.', 1));
  int status = 0;
  char* text = abi::__cxa_demangle(linked.c_str(), nullptr, nullptr, &status);
  const std::string name = status == 0 ? text : linked;
  std::free(text);
  return without_return_type(without_parameters(without(name, kAnonymous + "::")));
}

std::string short_name(const std::string& linked) {
  return without_template_arguments(without(plain_name(linked), "cairn::"));
}

bool is_fragment(const std::string& linked) { return linked.find('.', 1) != std::string::npos; }

}  // namespace cairn::profile
