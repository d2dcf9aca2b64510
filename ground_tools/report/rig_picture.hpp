/// What rectification makes of a raw pair, to look at.
#pragma once

#include <string>

#include "dataset/rectify.hpp"

namespace cairn::ground {

/// An SVG picture of both rectified images side by side: what has no source is hatched; a grid of the raw
/// image's rows and columns shows how it is bent. The sizes of the raw images must be told.
std::string rig_picture(const CameraPair& raw, const Rectification& rectification);

}  // namespace cairn::ground
