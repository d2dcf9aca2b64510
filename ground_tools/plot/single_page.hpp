/// HTML pages that need nothing else: no network, no other file, no library.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace cairn::ground {

/// A page of its own from its parts. `data` stands in the element `data`, as JSON; a content-security policy
/// forbids the page to load anything. `title` is plain text without markup.
std::string single_page(const std::string& title, const std::string& style, const std::string& body,
                        const nlohmann::ordered_json& data, const std::string& script);

/// The style sheet of all pages.
extern const char* const kPageStyle;  ///< page_style.cpp

}  // namespace cairn::ground
