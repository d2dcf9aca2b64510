/// Names of functions as people read them.
#pragma once

#include <string>

namespace cairn::profile {

/// Demangled, without parameters and return type: `cairn::Localizer::step_vo`. What the compiler split off
/// keeps the name of the whole. A name that is not mangled stays.
std::string plain_name(const std::string& linked);

/// Shorter still, for tables: without `cairn::`, with template arguments as `<..>`.
std::string short_name(const std::string& linked);

/// Split off or cloned by the compiler (`.part.0`, `.constprop.1`, `.cold`): not the function
/// that a caller names.
bool is_fragment(const std::string& linked);

}  // namespace cairn::profile
