/// HTML pages that need nothing else: no network, no other file, no library.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

/// The bytes of a file beside the code, in the program: defines `const char name[]`, ended by a zero. `path`
/// is a literal, from the root of the project. make builds anew what embeds files where any of them changed.
#define CAIRN_EMBED(name, path) \
  extern "C" const char name[]; \
  asm(".section .rodata\n" #name ":\n.incbin \"" path "\"\n.byte 0\n.previous")

namespace cairn::ground {

/// What one page has beside what all have (page.html, page.css, page.js): text of its own files.
struct PageParts {
  std::string title;  ///< plain text without markup
  std::string style;
  std::string body;
  std::string script;  ///< begins with `Page` defined, of page.js
};

/// The page, whole. `data` stands in the element `data`, as JSON, for Page.data; a content-security policy
/// forbids the page to load anything.
std::string single_page(const PageParts& parts, const nlohmann::ordered_json& data);

}  // namespace cairn::ground
